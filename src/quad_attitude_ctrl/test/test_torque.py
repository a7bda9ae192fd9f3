"""The torque limits of an attitude law: each axis its own, both ways."""

from quad_attitude_ctrl.torque import TorqueLimits, limited_torque
from quad_core.types import Vec3

LIMITS = TorqueLimits(1.0, 2.0, 3.0)


def test_each_axis_has_its_own_limit_both_ways_and_only_what_was_cut_is_said_to_be_limited():
    for command, torque, limited in (
        ((9.0, 9.0, 9.0), (1.0, 2.0, 3.0), (True, True, True)),
        ((-9.0, -9.0, -9.0), (-1.0, -2.0, -3.0), (True, True, True)),
        ((-1.5, 1.5, 2.5), (-1.0, 1.5, 2.5), (True, False, False)),
        ((0.5, -2.5, -3.5), (0.5, -2.0, -3.0), (False, True, True)),
    ):
        assert limited_torque(Vec3(*command), LIMITS) == (torque, limited)
