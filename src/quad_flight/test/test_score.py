"""The figures of a flight against sums written out by hand."""

import pytest

from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_flight.score import Score, scored, with_torque_change

NOTHING = Score(0, 0.0, 0.0, 0.0, 0.0)


def at(x, y, z):
    return VehicleState(p_w=Vec3(x, y, z))


def test_errors_of_three_samples():
    reference = TrajectoryPoint(p_w=Vec3(1.0, 2.0, 3.0))
    score = NOTHING
    # distances 3 (1, 2, 2), 7 (2, 3, 6) and 9 (1, 4, 8)
    for state in (at(2.0, 4.0, 1.0), at(-1.0, 5.0, 9.0), at(2.0, -2.0, -5.0)):
        score = scored(score, state, reference)
    assert score == Score(3, 9.0 + 49.0 + 81.0, 9.0, 9.0, 0.0)
    after = scored(score, at(1.0, 2.0, 5.0), reference)
    assert (after.samples, after.squared_error, after.largest_error, after.last_error) == (4, 143.0, 9.0, 2.0)


@pytest.mark.parametrize(
    ("before", "now", "change"),
    [
        (Vec3(0.0, 0.0, 0.0), Vec3(0.25, 0.0, 0.0), 0.25),
        (Vec3(0.0, 0.0, 0.0), Vec3(0.0, -0.5, 0.0), 0.5),
        (Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 2.0), 2.0),
        (Vec3(0.0, 0.0, 1.0), Vec3(0.0, 0.0, -1.0), 2.0),
        (Vec3(1.0, 2.0, 3.0), Vec3(-1.0, 2.5, 3.25), 2.75),
        (Vec3(1.0, 2.0, 3.0), Vec3(1.0, 2.0, 3.0), 0.0),
    ],
)
def test_torque_variation_adds_the_change_of_every_axis(before, now, change):
    start = NOTHING._replace(samples=2, squared_error=1.0, largest_error=1.0, last_error=0.5, torque_variation=8.0)
    assert with_torque_change(start, before, now) == start._replace(torque_variation=8.0 + change)


def test_a_torque_leaves_the_errors_and_an_error_leaves_the_torque():
    score = Score(4, 3.0, 2.0, 1.0, 0.5)
    assert with_torque_change(score, Vec3(), Vec3(1.0, 0.0, 0.0))[:4] == score[:4]
    assert scored(score, at(0.0, 0.0, 0.0), TrajectoryPoint()).torque_variation == 0.5
