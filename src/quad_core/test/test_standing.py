"""An estimate at rest, by what its last second shows."""

import pytest

from quad_core.geometry import ZERO
from quad_core.standing import Standing
from quad_core.types import Vec3, VehicleState


def standing(seconds, moved=ZERO, shown=ZERO, rate=100):
    """Return what ``seconds`` of an estimate show that moves at ``moved`` m/s and tells ``shown`` m/s."""
    found = Standing()
    for k in range(round(seconds * rate) + 1):
        time = k / rate
        place = Vec3(-17.0 + moved.x * time, 4.0 + moved.y * time, 13.2 + moved.z * time)
        found.note(100.0 + time, VehicleState(place, shown))
    return found


def test_one_that_rests_anywhere_or_drifts_slowly_may_fly():
    slow = Vec3(0.0, 0.0, -0.07)
    assert standing(2.0).refusal(0.15, "odom") == standing(2.0, slow, slow).refusal(0.15, "odom") == ""


@pytest.mark.parametrize(("moved", "shown"), [(Vec3(0.0, 0.0, -0.2), Vec3()), (Vec3(), Vec3(0.0, 0.2, 0.0))])
def test_a_drift_is_refused_by_name_whether_or_not_the_velocity_tells_it(moved, shown):
    text = standing(2.0, moved, shown).refusal(0.15, "vehicle_odometry")
    assert text.startswith("vehicle_odometry: the estimate moves while the vehicle stands: found")
    assert "0.20 m/s" in text
    assert text.endswith("expected less than 0.15 m/s")


def test_only_the_last_second_counts():
    found = standing(2.0, Vec3(1.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0))
    for k in range(1, 121):
        found.note(102.0 + k / 100, VehicleState(Vec3(-15.0, 4.0, 13.2)))
    assert found.refusal(0.15, "odom") == ""


def test_too_little_is_no_rest():
    assert Standing().refusal(0.15, "odom") == "odom: found states over 0.0 s, expected 0.5 s of them at rest"
    assert "0.3 s" in standing(0.3).refusal(0.15, "odom")
