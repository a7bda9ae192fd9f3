"""Which steps of which topics have arrived: what the recorder may acknowledge, and what is repeated, late or wrong."""

from enum import Enum


class Arrival(Enum):
    """What a message turned out to be."""

    NEW = "new"
    REPEAT = "repeat"  # equal to what came before for that step: not recorded again
    CONFLICT = "conflict"  # differs from what came before for that step
    OFF_STEP = "off step"  # the topic has no message at its stamp or step


class _Topic:
    """What is known of one topic: the step that comes next, which came before it, and fingerprints of the last ones."""

    __slots__ = ("ahead", "expected", "period", "prints")

    def __init__(self, period: int) -> None:
        self.period, self.expected = period, 0
        self.ahead: set[int] = set()
        self.prints: dict[int, int] = {}


class StepTracker:
    """Completeness of step topics.

    ``periods``: {topic: plant steps between two messages}; the first message of each topic belongs to step 0.
    ``optional``: the same of topics that count from their first message on, if there is one: steps before it are
    missing, but hold up nothing. Payloads of the last ``memory`` messages are kept as fingerprints to tell repeats from
    conflicts.
    """

    def __init__(
        self,
        periods: dict[str, int],
        plant_period_ns: int,
        memory: int = 4096,
        optional: dict[str, int] | None = None,
    ) -> None:
        """Start with nothing seen; raises ValueError for a period that is not positive."""
        self._optional = dict(optional or {})
        if plant_period_ns <= 0 or any(period <= 0 for period in (*periods.values(), *self._optional.values())):
            raise ValueError(f"periods must be positive, found {periods} steps and {plant_period_ns} ns")
        self._plant_period = plant_period_ns
        self._memory = memory
        self._topics = {topic: _Topic(period) for topic, period in periods.items()}
        self._before: dict[str, int] = {}

    def add(self, topic: str, stamp_ns: int, payload: bytes) -> Arrival:
        """Take in one message of a step topic by its stamp and say what it is."""
        step, rest = divmod(stamp_ns, self._plant_period)
        known = self._topics.get(topic)
        period = known.period if known else self._optional[topic]
        if rest or step < 0 or step % period:
            return Arrival.OFF_STEP
        known = known or self._begin(topic, step)
        prints = known.prints
        if step == known.expected:
            known.expected = step + period
            if known.ahead:
                self._skip(known)
        elif step < known.expected or step in known.ahead:
            before = prints.get(step)
            # A step older than the memory was verified when it came; its repeat is dropped unread.
            return Arrival.CONFLICT if before is not None and before != hash(payload) else Arrival.REPEAT
        else:
            known.ahead.add(step)
        prints[step] = hash(payload)
        prints.pop(step - self._memory * period, None)
        return Arrival.NEW

    def _begin(self, topic: str, step: int) -> _Topic:
        """Count an optional topic from here on."""
        known = self._topics[topic] = _Topic(self._optional[topic])
        known.expected = step
        self._before[topic] = step // known.period
        return known

    @staticmethod
    def _skip(known: _Topic) -> None:
        """Go on behind the steps that came ahead of their time."""
        while known.expected in known.ahead:
            known.ahead.remove(known.expected)
            known.expected += known.period

    def complete_through(self) -> int:
        """Return the last step up to which every topic has all its messages, or -1."""
        return min((known.expected for known in self._topics.values()), default=0) - 1

    def behind(self, step: int) -> str:
        """Return the first topic that has not all its messages of the steps before ``step``, or empty."""
        return next((topic for topic, known in self._topics.items() if known.expected < step), "")

    def missing_through(self, step: int) -> dict[str, int]:
        """Return {topic: number of its messages up to ``step`` that never came}, only where there are any."""
        found = {}
        for topic, known in self._topics.items():
            wanted = max(0, step // known.period + 1 - known.expected // known.period)
            lacking = wanted - sum(1 for ahead in known.ahead if ahead <= step) + self._before.get(topic, 0)
            if lacking > 0:
                found[topic] = lacking
        return found
