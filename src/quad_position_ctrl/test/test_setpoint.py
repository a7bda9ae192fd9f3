"""Eq. 38 and its limits against numbers worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quad_core.types import Actuation, TrajectoryPoint, Vec3
from quad_core.vehicle import Vehicle
from quad_position_ctrl.setpoint import (
    LiftLimits,
    LimitedLift,
    ThrustCommand,
    attitude_setpoint,
    desired_angles,
    integrals_frozen,
    internals_of,
    limited_lift,
    thrust_norm,
    thrust_projected,
)
from quad_position_ctrl.speed_limit import SpeedLimits, proportional_correction

OFF = LiftLimits(1e6, 1e6, -1e6, 1.58, 1e6, 0.0, False)
G = 10.0


def lifted(command, limits, max_lift=1e6):
    found = limited_lift(Vec3(*command), G, max_lift, limits)
    flags = [name for name in found._fields[1:] if getattr(found, name)]
    return tuple(found.lift), flags


def test_thrust_forms():
    assert thrust_norm(0.5, Vec3(3.0, 4.0, 12.0)) == 6.5
    assert thrust_projected(0.5, Vec3(3.0, 4.0, 12.0), Vec3(0.0, 0.6, 0.8)) == pytest.approx(6.0, rel=1e-15)
    assert thrust_projected(0.5, Vec3(0.0, 0.0, 10.0), Vec3(0.0, 0.0, -1.0)) == -5.0


@pytest.mark.parametrize(
    ("lift", "heading", "expected"),
    [
        ((0.0, 0.0, 10.0), 0.7, (0.0, 0.0)),
        ((10.0, 0.0, 10.0), 0.0, (0.0, math.pi / 4)),  # forward: nose down is positive about y
        ((0.0, -10.0, 10.0), 0.0, (math.pi / 4, 0.0)),  # to the right: right side down
        ((10.0, 0.0, 10.0), math.pi / 2, (math.pi / 4, 0.0)),  # east is to the right of north
        ((0.0, 10.0, 10.0), math.pi / 2, (0.0, math.pi / 4)),
        ((1.0, -1.0, 1.0), 0.0, (math.atan(math.sqrt(0.5)), math.pi / 4)),
    ],
)
def test_desired_angles(lift, heading, expected):
    angles = desired_angles(Vec3(*lift), heading, 2.5)
    assert angles == pytest.approx((*expected, 2.5), abs=1e-15)


def test_desired_angles_without_lift_are_finite():
    assert all(math.isfinite(angle) for angle in desired_angles(Vec3(1.0, 1.0, 0.0), 0.3, 0.0))


def test_without_limits_gravity_is_added_and_nothing_else():
    assert lifted((300.0, -400.0, -50.0), OFF) == ((300.0, -400.0, -40.0), [])


def test_horizontal_command_is_shortened_in_its_direction():
    limits = OFF._replace(acceleration_xy=5.0)
    assert lifted((30.0, -40.0, 2.0), limits) == ((3.0, -4.0, 12.0), ["acceleration_limited"])
    assert lifted((3.0, -4.0, 2.0), limits) == ((3.0, -4.0, 12.0), [])


@pytest.mark.parametrize(("up", "expected"), [(9.0, 16.0), (-9.0, 4.0)])
def test_vertical_command_is_bounded_both_ways(up, expected):
    assert lifted((0.0, 0.0, up), OFF._replace(acceleration_z=6.0)) == ((0.0, 0.0, expected), ["acceleration_limited"])


def test_descent_keeps_a_share_of_the_weight():
    assert lifted((1.0, 0.0, -50.0), OFF._replace(min_lift=0.3)) == ((1.0, 0.0, 3.0), ["descent_limited"])
    assert lifted((1.0, 0.0, -7.0), OFF._replace(min_lift=0.3)) == ((1.0, 0.0, 3.0), [])


def test_thrust_is_taken_from_the_horizontal_part_first():
    # of 20 m/s^2 the climb takes 16, which leaves 12 across
    limits = OFF._replace(vertical_priority=True)
    assert lifted((30.0, 40.0, 6.0), limits, 20.0) == (pytest.approx((7.2, 9.6, 16.0)), ["thrust_limited"])
    assert lifted((3.0, 4.0, 30.0), limits, 20.0) == (pytest.approx((0.0, 0.0, 20.0)), ["thrust_limited"])


def test_thrust_is_taken_in_proportion_without_vertical_priority():
    # (0, 30, 40) of length 50, shortened to 20
    assert lifted((0.0, 30.0, 30.0), OFF, 20.0) == (pytest.approx((0.0, 12.0, 16.0)), ["thrust_limited"])


def test_tilt_shortens_the_horizontal_part():
    limits = OFF._replace(tilt=math.atan(0.75))
    lift, flags = lifted((6.0, 8.0, -2.0), limits)
    assert lift == pytest.approx((3.6, 4.8, 8.0))
    assert flags == ["tilt_limited"]
    assert lifted((3.0, 4.0, -2.0), limits) == ((3.0, 4.0, 8.0), [])


def test_nothing_is_left_across_where_there_is_no_lift():
    limits = OFF._replace(tilt=0.8)
    assert lifted((3.0, 4.0, -12.0), limits) == (pytest.approx((0.0, 0.0, -2.0)), ["tilt_limited"])


FREE = LimitedLift(
    Vec3(0.0, 0.0, G), acceleration_limited=False, descent_limited=False, thrust_limited=False, tilt_limited=False
)
SLOW = proportional_correction(Vec3(), 1.0, 1.0, SpeedLimits())


@pytest.mark.parametrize("flag", ["acceleration_limited", "descent_limited", "tilt_limited"])
def test_integrals_rest_at_each_limit_of_the_lift(flag):
    assert not integrals_frozen(True, SLOW, ThrustCommand(FREE, 5.0, False), Actuation())
    assert integrals_frozen(True, SLOW, ThrustCommand(FREE._replace(**{flag: True}), 5.0, False), Actuation())


@pytest.mark.parametrize("flag", ["acceleration_limited", "descent_limited", "thrust_limited", "tilt_limited"])
def test_internals_of_a_law_say_which_limit_was_met(flag):
    at_the_limit = ThrustCommand(FREE, 5.0, thrust_limited=True)
    if flag != "thrust_limited":
        at_the_limit = ThrustCommand(FREE._replace(**{flag: True}), 5.0, thrust_limited=False)
    nothing = (Vec3(), Vec3(), Vec3(), Vec3(), Vec3())
    found = internals_of(*nothing, SLOW, at_the_limit, frozen=False)
    assert [name for name in found._fields if name.endswith("_limited") and getattr(found, name)] == [flag]


@given(st.floats(-8.0, 8.0), st.floats(-8.0, 8.0), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_the_set_attitude_thrusts_along_the_lift_wherever_the_vehicle_heads(x, y, heading, yaw):
    lift = Vec3(x, y, 9.0)
    angles = desired_angles(lift, heading, yaw)
    found = attitude_setpoint(Vehicle(), TrajectoryPoint(yaw=yaw), angles, 5.0, heading, False)
    attitude = Rotation.from_quat(found.q_wb)
    assert attitude.apply([0.0, 0.0, 1.0]) == pytest.approx(np.array(lift) / np.linalg.norm(lift), abs=1e-12)
    tilted = Rotation.from_euler("ZYX", [heading, angles.y, angles.x])
    assert (tilted.inv() * attitude).as_rotvec()[:2] == pytest.approx([0.0, 0.0], abs=1e-7)
    assert math.cos((tilted.inv() * attitude).magnitude()) == pytest.approx(math.cos(yaw - heading), abs=1e-9)


def test_tilted_in_the_set_heading_it_is_the_attitude_of_the_angles():
    angles = Vec3(0.3, -0.4, 2.0)
    found = attitude_setpoint(Vehicle(), TrajectoryPoint(yaw=2.0), angles, 5.0, 2.0, False)
    expected = Rotation.from_euler("ZYX", [angles.z, angles.y, angles.x])
    assert (expected.inv() * Rotation.from_quat(found.q_wb)).magnitude() < 1e-12
