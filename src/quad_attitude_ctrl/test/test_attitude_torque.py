"""The torque limits of an attitude law: each axis its own, both ways."""

from quad_attitude_ctrl.torque import TorqueLimits, limited_torque
from quad_core.types import Vec3

LIMITS = TorqueLimits(1.0, 2.0, 3.0)


def test_each_axis_has_its_own_limit_both_ways():
    assert limited_torque(Vec3(9.0, 9.0, 9.0), LIMITS).torque == Vec3(1.0, 2.0, 3.0)
    assert limited_torque(Vec3(-9.0, -9.0, -9.0), LIMITS).torque == Vec3(-1.0, -2.0, -3.0)
    assert limited_torque(Vec3(-0.9, 1.9, -2.9), LIMITS).torque == Vec3(-0.9, 1.9, -2.9)


def test_only_what_was_cut_is_said_to_be_limited():
    assert tuple(limited_torque(Vec3(-1.5, 1.5, 2.5), LIMITS).limited) == (True, False, False)
    assert tuple(limited_torque(Vec3(0.5, -2.5, -3.5), LIMITS).limited) == (False, True, True)
