"""What the log makes of a flight that the guard took over."""

import numpy as np
import pytest
from metric_tables import seconds, table

from quad_analysis.tables import Takeover, takeovers

pytestmark = pytest.mark.unit


class Bag:
    """A flight with these tables by topic; its truth ends at 9 s."""

    def __init__(self, tables):
        self.tables = {"truth": table(seconds(0.0, 9.0)), **tables}

    def has(self, topic):
        return topic in self.tables

    def array(self, topic):
        return self.tables[topic]


def guarded(*rows, **columns):
    """Return a flight with these reports of the guard: mode, reason, plant step since when, time in s."""
    modes, reasons, since, times = zip(*rows, strict=True)
    report = {"mode": modes, "reason_text": np.array(reasons, object), "since": since, **columns}
    return Bag({"flight/guard": table(seconds(*times), **report)})


PASSES = (0, "good", 0, 0.0)
LOST = (1, "no good wrench", 1525, 3.05)
LANDS = (1, "no good wrench", 1525, 3.15)
KILLED = (2, "no state at all", 2000, 4.0)
RELEASED = (0, "good", 2500, 5.0)


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ([PASSES], []),
        ([PASSES, LOST, LANDS], [("descend", "no good wrench", 1525, 3.05, 9.0)]),
        ([PASSES, LOST, RELEASED], [("descend", "no good wrench", 1525, 3.05, 5.0)]),
        ([LOST, KILLED], [("descend", "no good wrench", 1525, 3.05, 4.0), ("kill", "no state at all", 2000, 4.0, 9.0)]),
    ],
)
def test_every_time_in_which_the_guard_flew_is_found(rows, expected):
    assert takeovers(guarded(*rows)) == [Takeover(*one[:3], *seconds(*one[3:])) for one in expected]
    assert takeovers(Bag({})) == []
