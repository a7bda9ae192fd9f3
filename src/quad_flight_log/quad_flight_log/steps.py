"""What the recorder knows of the steps of a flight: its time, and which messages came. Memory does not grow."""

import math
import sys
from collections import Counter
from collections.abc import Iterable, Mapping

_SLACK = 2_000_000_000  # ns: what publishers keep for a recorder that was stopped, and the window of the lockstep
_PACE = 2.0  # flight time over steady time, at most, while nothing came
PATIENCE = 2.0  # s without an answer of a shadow after which the recorder does not wait for it


class NewestStamp:
    """``newest``: the largest stamp in ns that was accepted; a foreign node's far-future one must not move it."""

    def __init__(self, now: float) -> None:
        """Begin at stamp 0; ``now`` in s on the steady clock, as below."""
        self.newest = 0
        self._moved = now

    def accepts(self, stamp_ns: int, now: float) -> bool:
        """Return whether a message of ``stamp_ns`` can belong to the flight, and move the clock there if it can."""
        if stamp_ns > self.newest:
            if stamp_ns - self.newest > _SLACK + _PACE * 1e9 * (now - self._moved):
                return False
            self.newest, self._moved = stamp_ns, now
        return True


class StepCounter:
    """Counts the messages of step topics by their stamps, which rise in each topic.

    ``periods``: {topic: ns between two messages}, the first at stamp 0. Topics of ``optional`` count from their first
    message on: what they lack before it is missing, but holds up nothing. In real time a publisher may leave out
    steps: a message with its publisher's ``number`` shows how many were published and did not come.
    ``shadows``: topics that are waited for while they answer, and whose gaps are no loss of the flight: the plant waits
    for no shadow, and one far behind would lose steps. ``now``: s on the steady clock.
    """

    def __init__(
        self, periods: Mapping[str, int], optional: Iterable[str] = (), shadows: Iterable[str] = (), now: float = 0.0
    ) -> None:
        self._periods, self._optional = dict(periods), frozenset(optional)
        self._newest = {topic: -period for topic, period in periods.items()}
        self._came = dict.fromkeys(shadows, now)
        self._numbers: dict[str, int] = {}
        self._lost: Counter[str] = Counter()

    def add(self, topic: str, stamp_ns: int, now: float, number: int | None = None) -> None:
        """Take in a message; one of a topic that is not expected, or not newer than the newest, is not counted."""
        newest, passed_over = self._newest.get(topic), sys.maxsize
        if newest is None or stamp_ns <= newest:
            return
        if number is not None:
            last = self._numbers.get(topic, 0)
            passed_over = number - 1 - (last if number > last else 0)  # a second publisher counts from 1
            self._numbers[topic] = number
        left_out = (stamp_ns - newest - 1) // self._periods[topic]
        self._lost[topic] += min(left_out, passed_over)
        self._newest[topic] = stamp_ns
        if topic in self._came:
            self._came[topic] = now

    def give_up(self, topics: Iterable[str]) -> None:
        """Wait for none of ``topics``, each of a shadow whose process has ended, until a message of it comes."""
        self._came.update(dict.fromkeys(topics, -math.inf))

    def complete_through(self, now: float) -> int:
        """Return the last stamp in ns up to which no topic waits for a message, -1 before the first of each."""
        answering = [topic for topic, came in self._came.items() if now - came < PATIENCE]
        waited = [*self._counted(), *answering]
        return min((self._newest[topic] + self._periods[topic] for topic in waited), default=sys.maxsize) - 1

    def missing_through(self, stamp_ns: int) -> dict[str, int]:
        """Return {topic: messages that never came} of a flight that ended at ``stamp_ns``, where there are any."""
        ends = {topic: (stamp_ns - self._newest[topic]) // self._periods[topic] for topic in self._counted()}
        found = {topic: self._lost[topic] + (topic not in self._numbers) * max(0, end) for topic, end in ends.items()}
        return {topic: count for topic, count in found.items() if count > 0}

    def silent_through(self, stamp_ns: int) -> list[str]:
        """Return which topics with numbers of their publisher end earlier than one message before ``stamp_ns``."""
        ends = {topic: self._newest[topic] for topic in self._counted() if topic in self._numbers}
        return [
            f"no message of {topic} after {1e-9 * end:.3g} s"
            for topic, end in ends.items()
            if end + self._periods[topic] <= stamp_ns
        ]

    def _counted(self) -> list[str]:
        return [
            topic
            for topic, newest in self._newest.items()
            if topic not in self._came and (newest >= 0 or topic not in self._optional)
        ]
