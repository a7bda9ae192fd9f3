"""One axis of AIBS where the virtual velocity is bounded, by hand, and where it is not."""

import pytest

from quad_position_ctrl.axis import Axis, Correction, Motion, axis_command, updated_gain

AXIS = Axis(position_gain=2.0, integral_gain=0.5, adaptation_rate=1.5, initial_gain=1.0, adaptation_leak=0.2)
MOTION = Motion(10.0, 1.5, 4.0, 0.8, 0.3)


def test_bounded_command_by_hand():
    """e = 6, v_d' = 0.8 - 2.5, e' = 1.5 + 1.7; U = (0.3 - 0.9) - 0.25 * 6 - 3 * 3.2 + 0.4 * 1.5 - 0.6."""
    command = axis_command(AXIS, 3.0, 0.7, -0.4, MOTION, Correction(-2.5, -0.9, 0.25, True), 0.6)
    assert command == pytest.approx((6.0, -1.7, 3.2, -11.7), rel=1e-14)


def test_untouched_command_by_hand():
    """v_d' = 0.8 - 2 * 6 - 0.5 * 0.7; U = 0.3 + (4 - 1 - 0.5) * 6 - (2 + 3) * 13.05 + 0.6 + 2 * 0.5 * 0.7 - 0.6."""
    command = axis_command(AXIS, 3.0, 0.7, -0.4, MOTION, Correction(-12.35, -1.4, 1.0, False), 0.6)
    assert command == pytest.approx((6.0, -11.55, 13.05, -49.25), rel=1e-14)


def test_gain_after_a_step_by_hand():
    """4 + 0.01 * (1.5 * 2^2 - 0.2 * (4 - 1))."""
    assert updated_gain(AXIS, 4.0, -2.0, 0.01) == pytest.approx(4.054, rel=1e-14)
