"""Which steps of which topics have arrived: what the recorder may acknowledge, and what is repeated, late or wrong."""

from collections import OrderedDict
from enum import Enum


class Arrival(Enum):
    """What a message turned out to be."""

    NEW = "new"
    REPEAT = "repeat"  # equal to what came before for that step: not recorded again
    CONFLICT = "conflict"  # differs from what came before for that step
    OFF_STEP = "off step"  # its stamp or step is none at which the topic has a message


class StepTracker:
    """Completeness of step topics.

    ``periods``: {topic: plant steps between two messages}; the first message of each topic belongs to step 0. Payloads
    of the last ``memory`` steps are kept as fingerprints to tell repeats from conflicts.
    """

    def __init__(self, periods: dict[str, int], plant_period_ns: int, memory: int = 4096) -> None:
        """Start with nothing seen; raises ValueError for a period that is not positive."""
        if plant_period_ns <= 0 or any(period <= 0 for period in periods.values()):
            raise ValueError(f"periods must be positive, found {periods} steps and {plant_period_ns} ns")
        self.periods = dict(periods)
        self.plant_period_ns = plant_period_ns
        self._memory = memory
        self._next = dict.fromkeys(periods, 0)
        self._ahead: dict[str, set[int]] = {topic: set() for topic in periods}
        self._prints: dict[str, OrderedDict[int, int]] = {topic: OrderedDict() for topic in periods}

    def add(self, topic: str, stamp_ns: int, payload: bytes) -> Arrival:
        """Take in one message of a step topic by its stamp and say what it is."""
        step, rest = divmod(stamp_ns, self.plant_period_ns)
        period = self.periods[topic]
        if rest or step < 0 or step % period:
            return Arrival.OFF_STEP
        prints = self._prints[topic]
        expected = self._next[topic]
        if step < expected or step in self._ahead[topic]:
            known = prints.get(step)
            # A step older than the memory was verified when it came; its repeat is dropped unread.
            return Arrival.CONFLICT if known is not None and known != hash(payload) else Arrival.REPEAT
        prints[step] = hash(payload)
        if len(prints) > self._memory:
            prints.popitem(last=False)
        if step == expected:
            self._advance(topic, expected + period)
        else:
            self._ahead[topic].add(step)
        return Arrival.NEW

    def _advance(self, topic: str, expected: int) -> None:
        ahead, period = self._ahead[topic], self.periods[topic]
        while expected in ahead:
            ahead.remove(expected)
            expected += period
        self._next[topic] = expected

    def complete_through(self) -> int:
        """Return the last step up to which every topic has all its messages, -1 if there is none."""
        return min(self._next.values(), default=0) - 1

    def missing_through(self, step: int) -> dict[str, int]:
        """Return {topic: number of its messages up to ``step`` that never came}, only where there are any."""
        found = {}
        for topic, expected in self._next.items():
            period = self.periods[topic]
            wanted = max(0, step // period + 1 - expected // period)
            lacking = wanted - sum(1 for ahead in self._ahead[topic] if ahead <= step)
            if lacking > 0:
                found[topic] = lacking
        return found
