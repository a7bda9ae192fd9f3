"""Which steps of a real-time flight are not in the bag: no node waits for the recorder, a late plant skips."""

from collections import Counter
from collections.abc import Mapping


class GapCounter:
    """Counts the missing messages of step topics, in memory that does not grow.

    ``missing``: {topic: messages that lie between two that are further apart than one and a half periods}.
    """

    def __init__(self, periods_ns: Mapping[str, int]) -> None:
        """Expect a message of each topic every so many ns, the first at stamp 0."""
        self.missing: Counter[str] = Counter()
        self._periods = dict(periods_ns)
        self._newest = {topic: -period for topic, period in periods_ns.items()}

    def add(self, topic: str, stamp_ns: int) -> None:
        """Take in a message; one of a topic that is not expected, or older than the newest, changes nothing."""
        newest = self._newest.get(topic)
        if newest is None or stamp_ns <= newest:
            return
        period = self._periods[topic]
        if 2 * (stamp_ns - newest) > 3 * period:
            self.missing[topic] += _steps(stamp_ns - newest, period) - 1
        self._newest[topic] = stamp_ns

    def reached(self, stamp_ns: int) -> bool:
        """Return whether every topic of which anything came has come to ``stamp_ns``."""
        return all(newest < 0 or newest >= stamp_ns for newest in self._newest.values())

    def missing_through(self, stamp_ns: int) -> dict[str, int]:
        """Return {topic: messages that never came} of a flight that ended at ``stamp_ns``, where there are any.

        A topic without messages does not count.
        """
        spoke = {topic: newest for topic, newest in self._newest.items() if newest >= 0}
        ends = {topic: (stamp_ns - newest) // self._periods[topic] - 1 for topic, newest in spoke.items()}
        found = {topic: self.missing[topic] + max(0, end) for topic, end in ends.items()}
        return {topic: count for topic, count in found.items() if count > 0}


def _steps(gap_ns: int, period_ns: int) -> int:
    return (2 * gap_ns + period_ns) // (2 * period_ns)
