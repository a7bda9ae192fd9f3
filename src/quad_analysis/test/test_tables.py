"""What the log makes of a flight that the guard took over; the example of the page of the log."""

import re
from pathlib import Path

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


def test_the_example_of_the_documentation_runs(flown, flown_bag, tmp_path, monkeypatch):
    page = (Path(__file__).parents[3] / "docs" / "how_to" / "flight_log.md").read_text(encoding="utf-8")
    example, of_others = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (tmp_path / "flights").mkdir()
    (tmp_path / "flights" / "case1-1-1").symlink_to(flown_bag)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(example, names)
    assert names["measured"](names["flight"]).position_rmse == pytest.approx(flown.result.rmse, rel=1e-12)
    wrench = flown.result.topics["wrench_setpoint"]
    np.testing.assert_array_equal(names["frame"]["wrench.torque.z"], wrench["torque_b"][:, 2])
    np.testing.assert_array_equal(names["frame"].index, wrench["stamp_ns"])
    others: dict = {}
    exec(of_others, others)
    heights = flown.result.topics["truth"]["p_w"][:, 2]
    np.testing.assert_array_equal(others["heights"], heights)
    assert others["truth"].p_w[2] == heights[-1]
