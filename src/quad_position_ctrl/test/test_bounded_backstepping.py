"""One axis of AIBS where the virtual velocity is bounded, by hand, and where it is not."""

import pytest

from quad_position_ctrl.backstepping import AxisGains, AxisState, axis_command, updated_gain
from quad_position_ctrl.speed_limit import AxisCorrection

GAINS = AxisGains(position_gain=2.0, integral_gain=0.5, adaptation_rate=1.5, initial_gain=1.0, adaptation_leak=0.2)
STATE = AxisState(
    position=10.0, velocity=1.5, reference_position=4.0, reference_velocity=0.8, reference_acceleration=0.3
)
REST = {"adaptive_gain": 3.0, "integral": 0.7, "drag": -0.4, "disturbance": 0.6}


def test_bounded_command_by_hand():
    """e = 6, v_d' = 0.8 - 2.5, e' = 1.5 + 1.7; U = (0.3 - 0.9) - 0.25 * 6 - 3 * 3.2 + 0.4 * 1.5 - 0.6."""
    command = axis_command(GAINS, STATE, AxisCorrection(-2.5, -0.9, 0.25, True), **REST)
    assert command[:4] == pytest.approx((6.0, -1.7, 3.2, -11.7), rel=1e-14)


def test_untouched_command_by_hand():
    """v_d' = 0.8 - 2 * 6 - 0.5 * 0.7; U = 0.3 + (4 - 1 - 0.5) * 6 - (2 + 3) * 13.05 + 0.6 + 2 * 0.5 * 0.7 - 0.6."""
    command = axis_command(GAINS, STATE, AxisCorrection(-12.35, -1.4, 1.0, False), **REST)
    assert command[:4] == pytest.approx((6.0, -11.55, 13.05, -49.25), rel=1e-14)


def test_gain_after_a_step_by_hand():
    """4 + 0.01 * (1.5 * 2^2 - 0.2 * (4 - 1))."""
    assert updated_gain(GAINS, 4.0, -2.0, 0.01) == pytest.approx(4.054, rel=1e-14)
