"""What the log makes of a flight that the guard, or another controller, took over."""

import numpy as np
import pytest

from quad_flight_log.analysis.takeovers import Flier, Takeover, fliers, takeovers

pytestmark = pytest.mark.unit

GUARD = np.dtype([("mode", "u1"), ("reason_text", "O"), ("since", "i8"), ("stamp_ns", "i8")])
TRUTH = np.dtype([("stamp_ns", "i8")])


class Bag:
    """A flight with the given rows of flight/guard, whose truth ends at 9 s."""

    def __init__(self, rows):
        self.rows, self.metadata = rows, {"plant_period_ns": "2000000"}

    def has(self, topic):
        return topic == "truth" or (topic == "flight/guard" and bool(self.rows))

    def array(self, topic):
        if topic == "truth":
            return np.array([(0,), (9_000_000_000,)], dtype=TRUTH)
        return np.array(self.rows, dtype=GUARD)


PASSES = (0, "good", 0, 100)
LOST = (1, "no good wrench", 1525, 3_050_000_000)
LANDS = (1, "no good wrench", 1525, 3_150_000_000)
KILLED = (2, "no state at all", 2000, 4_000_000_000)
RELEASED = (0, "good", 2500, 5_000_000_000)


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ([], []),
        ([PASSES], []),
        ([PASSES, LOST, LANDS], [("descend", "no good wrench", 1525, 3_050_000_000, 9_000_000_000)]),
        ([PASSES, LOST, RELEASED], [("descend", "no good wrench", 1525, 3_050_000_000, 5_000_000_000)]),
        (
            [LOST, KILLED],
            [
                ("descend", "no good wrench", 1525, 3_050_000_000, 4_000_000_000),
                ("kill", "no state at all", 2000, 4_000_000_000, 9_000_000_000),
            ],
        ),
    ],
)
def test_every_time_in_which_the_guard_flew_is_found(rows, expected):
    assert takeovers(Bag(rows)) == [Takeover(*one) for one in expected]


def test_a_guard_that_names_no_run_or_another_is_nobody_s():
    named = np.dtype([*GUARD.descr, ("run_id", "O")])
    for run_id, expected in (("", []), ("theirs", []), ("ours", [("descend", 1525)])):
        bag = Bag([PASSES, LOST])
        bag.metadata["run_id"] = "ours"
        bag.array = lambda topic, bag=bag, run_id=run_id: (
            Bag.array(bag, topic) if topic == "truth" else np.array([(*PASSES, "ours"), (*LOST, run_id)], dtype=named)
        )
        assert [(one.mode, one.step) for one in takeovers(bag)] == expected


class TakenOver(Bag):
    """A flight with the given rows of flight/takeover."""

    def has(self, topic):
        return topic == "flight/takeover"

    def array(self, topic):
        names = [("step", "u8"), ("role", "O"), ("detail", "O"), ("memory_step", "u8")]
        return np.array(self.rows, dtype=np.dtype(names))


MAIN, SHADOW = "attitude_controller", "shadow_attitude_controller"


def test_a_replaced_controller_may_fly_again_and_a_repetition_is_none():
    rows = [
        (1000, SHADOW, "silent", 0),
        (1000, SHADOW, "silent", 0),
        (2500, "shadow_position_controller", "silent", 0),
        (3000, MAIN, "asked", 1400),
        (2000, SHADOW, "late news", 0),  # the highest step counts
    ]
    assert fliers(TakenOver(rows), MAIN) == [
        Flier(MAIN, 0, 0, ""),
        Flier(SHADOW, 1000, 0, "silent"),
        Flier(MAIN, 3000, 1400, "asked"),
    ]
