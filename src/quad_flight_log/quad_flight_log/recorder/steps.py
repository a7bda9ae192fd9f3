"""What the recorder knows of the steps of a flight: its time, and which messages came. Memory does not grow."""

import sys
from collections import Counter
from collections.abc import Iterable, Mapping

from quad_node import topics

_SLACK = 2_000_000_000  # ns: what publishers keep for a recorder that was stopped, and the window of the lockstep
_PACE = 2.0  # flight time over steady time, at most, while nothing came
_BEHIND = topics.LOCKSTEP_HISTORY // 2  # steps from a shadow's newest answer to the acknowledged step; the window adds
PATIENCE = 2.0  # s without an answer of a shadow after which the recorder does not wait for it


class FlightClock:
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
    message on: what they lack before it is missing, but holds up nothing. ``spare``: how many messages each topic may
    lack at the end of the flight.
    """

    def __init__(self, periods: Mapping[str, int], optional: Iterable[str] = (), spare: int = 0) -> None:
        """Start with nothing seen; raises ValueError for a period that is not positive."""
        if any(period <= 0 for period in periods.values()):
            raise ValueError(f"periods must be positive, found {dict(periods)} ns")
        self._periods, self._optional, self._spare = dict(periods), frozenset(optional), spare
        self._newest = {topic: -period for topic, period in periods.items()}
        self._lost: Counter[str] = Counter()

    def add(self, topic: str, stamp_ns: int) -> None:
        """Take in a message; one of a topic that is not expected, or not newer than the newest, changes nothing."""
        newest = self._newest.get(topic)
        if newest is None or stamp_ns <= newest:
            return
        period = self._periods[topic]
        # rounded down at one and a half periods: a slow topic that follows a late plant lacks nothing
        self._lost[topic] += max(0, (2 * (stamp_ns - newest) + period - 1) // (2 * period) - 1)
        self._newest[topic] = stamp_ns

    def complete_through(self) -> int:
        """Return the last stamp in ns up to which no topic waits for a message, -1 if one has none yet."""
        return min((newest + self._periods[topic] for topic, newest in self._counted()), default=sys.maxsize) - 1

    def missing_through(self, stamp_ns: int) -> dict[str, int]:
        """Return {topic: messages that never came} of a flight that ended at ``stamp_ns``, where there are any."""
        found = {
            topic: self._lost[topic] + max(0, (stamp_ns - newest) // self._periods[topic] - self._spare)
            for topic, newest in self._counted()
        }
        return {topic: count for topic, count in found.items() if count > 0}

    def _counted(self) -> list[tuple[str, int]]:
        return [(topic, newest) for topic, newest in self._newest.items() if newest >= 0 or topic not in self._optional]


class ShadowPace:
    """How far shadow controllers have come.

    The plant waits for no shadow, so the recorder acknowledges later while one is behind: a shadow that is behind by
    more than the publishers' history loses steps of its own flight.
    """

    def __init__(self, periods_ns: Mapping[str, int], now: float) -> None:
        """Expect answers of topics every so many ns from ``now`` (s on the steady clock, as below) on."""
        self._periods = dict(periods_ns)
        self._newest = dict.fromkeys(periods_ns, -1)
        self._came = dict.fromkeys(periods_ns, now)

    def add(self, topic: str, stamp_ns: int, now: float) -> None:
        """Take in the stamp of an answer."""
        self._newest[topic], self._came[topic] = stamp_ns, now

    def allowed(self, step: int, plant_period_ns: int, now: float) -> int:
        """Return the step that may be acknowledged: ``step``, or less while a shadow that answers is far behind."""
        waited = [stamp for topic, stamp in self._newest.items() if now - self._came[topic] < PATIENCE]
        return min([step, *(stamp // plant_period_ns + _BEHIND for stamp in waited)])

    def answered(self, stamp_ns: int) -> bool:
        """Return whether every shadow has answered the last step up to ``stamp_ns`` that it is asked for."""
        return all(self._newest[topic] >= stamp_ns // period * period for topic, period in self._periods.items())
