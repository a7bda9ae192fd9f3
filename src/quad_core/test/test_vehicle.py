"""The nominal vehicle and what a stage asks for when its input went silent."""

import math

import pytest

from quad_core.geometry import quaternion_from_euler
from quad_core.parameters import ParameterError, build
from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle, check_inertia, hold_position, level_hover, max_thrust


def test_largest_thrust_is_the_stated_multiple_of_the_weight():
    vehicle = Vehicle()._replace(mass=2.0, gravity=10.0, thrust_to_weight=2.5)
    assert max_thrust(vehicle) == 50.0


@pytest.mark.parametrize(
    "name", ["mass", "gravity", "arm_length", "inertia_xx", "lift_coefficient", "thrust_to_weight"]
)
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_vehicle_that_cannot_be_is_refused(name, value):
    with pytest.raises(ParameterError, match=f"vehicle.{name}"):
        build(Vehicle, {name: value}, "vehicle.")


@pytest.mark.parametrize(("changed", "named"), [
    ({"inertia_xx": 0.02}, "vehicle.inertia_xx: found 0.02 kg m^2, expected at most 0.0105"),
    ({"inertia_yy": 0.011}, "vehicle.inertia_yy: found 0.011 kg m^2, expected at most 0.0105"),
    ({"inertia_zz": 0.0071}, "vehicle.inertia_zz: found 0.0071 kg m^2, expected at most 0.007"),
])  # fmt: skip
def test_an_inertia_that_no_body_has_is_refused(changed, named):
    check_inertia(Vehicle())
    check_inertia(Vehicle(inertia_zz=0.00706))  # rounded
    with pytest.raises(ParameterError, match=named.replace("^", r"\^")):
        check_inertia(Vehicle(**changed))


def test_level_hover_keeps_the_heading_and_carries_the_weight():
    vehicle = Vehicle()._replace(mass=2.0, gravity=10.0, thrust_to_weight=4.0)
    state = VehicleState(q_wb=quaternion_from_euler(Vec3(0.4, -0.3, 2.1)), omega_b=Vec3(1.0, 2.0, 3.0))
    setpoint = level_hover(vehicle, state)
    assert setpoint.angles == pytest.approx((0.0, 0.0, 2.1), abs=1e-14)
    assert setpoint.q_wb == pytest.approx((0.0, 0.0, math.sin(1.05), math.cos(1.05)), abs=1e-14)
    assert (setpoint.thrust, setpoint.thrust_fraction) == (20.0, 0.25)
    assert setpoint.rates == setpoint.accelerations == (0.0, 0.0, 0.0)


def test_held_position_is_the_last_one_at_rest():
    vector = Vec3(1.0, 2.0, 3.0)
    last = TrajectoryPoint(4.0, Vec3(5.0, 6.0, 7.0), vector, vector, vector, vector, 0.8, 0.9, 1.1)
    hold = hold_position(last)
    assert (hold.trajectory_time, hold.p_w, hold.yaw) == (4.0, (5.0, 6.0, 7.0), 0.8)
    assert hold.v_w == hold.a_w == hold.jerk_w == hold.snap_w == (0.0, 0.0, 0.0)
    assert (hold.yaw_rate, hold.yaw_acceleration) == (0.0, 0.0)
