"""How far shadow controllers have come. The plant waits for none, so the recorder's leave to go on does, for a while.

A shadow that falls behind by more than the publishers' history would lose steps of its own flight.
"""

import time

from quad_node import topics

_ROOM = topics.LOCKSTEP_HISTORY // 2
"""Steps that a shadow may be behind what is acknowledged; the plant's window comes on top."""
PATIENCE = 2.0
"""s without a word after which no node waits for a shadow any more, until it speaks again."""


class ShadowPace:
    """The newest stamp of each topic of the shadows, and when it came."""

    def __init__(self, plant_period_ns: int) -> None:
        """Start without shadows."""
        self._plant_period = plant_period_ns
        self._newest: dict[str, int] = {}
        self._heard: dict[str, float] = {}

    def expect(self, topic: str) -> None:
        """Wait for the answers of ``topic``, once the flight has begun."""
        self._newest[topic] = -1

    def add(self, topic: str, stamp_ns: int) -> None:
        """Take in the stamp of an answer."""
        self._newest[topic], self._heard[topic] = stamp_ns, time.monotonic()

    def leave(self, complete: int) -> int:
        """Return the step that may be acknowledged: ``complete``, or less while a living shadow is far behind."""
        now = time.monotonic()
        for topic, stamp in self._newest.items():
            if now - self._heard.setdefault(topic, now) < PATIENCE:
                complete = min(complete, stamp // self._plant_period + _ROOM)
        return complete

    def answered(self, step: int, periods: dict[str, int]) -> bool:
        """Return whether every shadow has answered the last step up to ``step`` that it is asked for.

        ``periods``: {role: plant steps between two answers}.
        """
        for topic, stamp in self._newest.items():
            period = periods[topics.TOPICS[topic].publishers[0]]
            if stamp < step // period * period * self._plant_period:
                return False
        return True
