"""The last answers of two controllers of one stage, to be sent again or in the other's place. No ROS calls."""

import struct
from collections import deque

_STAMP = struct.Struct("<iI")
_LEAST = 12  # bytes of a message that begins with a stamp
_SECOND = 1_000_000_000  # ns

RECENT = 64
"""Answers that are kept: more than the window of the lockstep."""

Placed = list[tuple[int, bytes]]
"""Messages, each with its place: 0 the answer, 1 its internals."""


class RecentAnswers:
    """What this controller computed and what the other one sent. ``newest``: the other's last steps, by place."""

    def __init__(self, plant_period: int) -> None:
        """Know nothing yet; ``plant_period`` in ns."""
        self.newest = [-1, -1]
        self._period = plant_period
        self._own, self._others = ([deque[bytes](maxlen=RECENT) for _ in self.newest] for _ in range(2))

    def keep(self, place: int, payload: bytes) -> None:
        """Keep what was computed here."""
        self._own[place].append(payload)

    def hear(self, place: int, payload: bytes) -> bool:
        """Keep what the other one sent; returns whether it is a message with a stamp."""
        if len(payload) < _LEAST:
            return False
        self.newest[place] = max(self.newest[place], self.step_of(payload))
        self._others[place].append(payload)
        return True

    def forget_the_other(self, step: int) -> None:
        """Begin to listen: up to ``step`` all was answered here."""
        self.newest = [step, step]
        for sent in self._others:
            sent.clear()

    def of_the_other(self) -> Placed:
        """Return what the other one sent last: who dies in the middle of sending has reached some readers only."""
        return [(place, payload) for place, sent in enumerate(self._others) for payload in sent]

    def computed_since(self, steps: list[int]) -> Placed:
        """Return what was computed here from the steps in ``steps`` on, one of them for each place."""
        each = [(place, payload) for place, computed in enumerate(self._own) for payload in computed]
        return [(place, payload) for place, payload in each if self.step_of(payload) >= steps[place]]

    def step_of(self, payload: bytes) -> int:
        """Return the plant step that a message answers."""
        seconds, nanoseconds = _STAMP.unpack_from(payload, 4)
        return int(seconds * _SECOND + nanoseconds) // self._period
