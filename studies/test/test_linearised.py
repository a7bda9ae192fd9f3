"""The matrix of the closed loop grows as fast as a flight does, and knows which loops are stable."""

import numpy as np
import pytest
from linearised import STABLE, hover, largest, numbers, with_numbers

from quad_core import plugins
from quad_core.types import Vec3
from quad_flight.flight import fly

pytestmark = pytest.mark.skipif(
    "pid" not in plugins.names(plugins.ATTITUDE_LAW), reason="plug-ins are not installed: run scripts/setup"
)
PLAIN = [f"{role}.prediction.enabled=false" for role in ("position_controller", "attitude_controller")]
PAIR = {"position": "pid", "attitude": "pid"}


def late(delay):
    return [f"simulator.sensor.delay={delay}", *PLAIN]


def test_a_late_loop_grows_in_flight_as_its_matrix_says():
    rate = np.log(largest(hover(late(0.05), **PAIR))) / 0.01  # 1/s, from one position step of 10 ms
    start = ["simulator.rigid_body.initial.omega.x=1e-10", "trajectory.hover.duration=3.0"]
    truth = fly(hover([*late(0.05), *start], **PAIR)).topics["truth"]
    times, rates = truth["stamp_ns"] * 1e-9, np.abs(truth["omega_b"][:, 0])
    peaks = 1 + np.flatnonzero((rates[1:-1] > rates[:-2]) & (rates[1:-1] > rates[2:]) & (times[1:-1] > 1.0))
    assert np.polyfit(times[peaks], np.log(rates[peaks]), 1)[0] == pytest.approx(rate, rel=5e-3)


def test_a_loop_in_time_is_stable_and_one_of_wrong_sign_is_not():
    assert largest(hover(PLAIN, **PAIR)) <= STABLE
    assert largest(hover(late(0.02), **PAIR)) <= STABLE
    weak = ["simulator.rigid_body.effectiveness.roll=0.0", *PLAIN]
    assert largest(hover([*weak, "position_controller.pid.xy.integral=0.0"], **PAIR)) >= 1.0


def test_a_loop_that_swings_up_to_its_limits_before_the_matrix_is_taken_is_not_stable():
    assert largest(hover(late(0.1), position="aibs", attitude="indi")) == np.inf


def test_numbers_are_the_floats_in_order():
    value = (Vec3(1.0, 2.0, 3.0), 7, (True, 4.0))
    assert numbers(value) == [1.0, 2.0, 3.0, 4.0]
    assert with_numbers(value, iter([5.0, 6.0, 7.0, 8.0])) == (Vec3(5.0, 6.0, 7.0), 7, (True, 8.0))
