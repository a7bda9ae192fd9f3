"""Torque ahead of rotors that lag: what they give is what was asked for, a shorter lag later."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from quad_core.rotor_lead import Given, LeadShown, RotorLead, ahead_of_rotors
from quad_core.types import Vec3, Wrench
from quad_core.vehicle import Vehicle

DT = 0.002


def sent(parameters, vehicle, torques, dt=DT):
    """Return the torques sent for ``torques``, both of shape (n, 3)."""
    memory, found = Given(), []
    for torque in torques:
        wrench, memory, shown = ahead_of_rotors(parameters, vehicle, memory, Wrench(5.0, Vec3(*map(float, torque))), dt)
        assert wrench.thrust == 5.0
        assert np.allclose(np.subtract(wrench.torque_b, torque), shown.torque_lead_b)
        found.append(wrench.torque_b)
    return np.array(found)


def lagged(torques, lag, dt=DT):
    """Return what a first-order lag gives at the end of each step, by the matrix exponential."""
    step = expm(dt * np.array([[-1.0 / lag, 1.0 / lag], [0.0, 0.0]]))
    given, found = np.zeros(3), []
    for torque in torques:
        given = step[0, 0] * given + step[0, 1] * torque
        found.append(given)
    return np.array(found)


@settings(max_examples=60, deadline=None)
@given(st.floats(0.005, 0.3), st.floats(0.05, 0.95), st.floats(0.0005, 0.02), st.integers(0, 10**6))
def test_lagging_rotors_give_what_faster_ones_would(lag, ratio, dt, seed):
    asked = np.random.default_rng(seed).uniform(-0.5, 0.5, (60, 3))
    parameters = RotorLead(enabled=True, remaining_lag=ratio * lag)
    commands = sent(parameters, Vehicle(rotor_time_constant=lag), asked, dt)
    assert lagged(commands, lag, dt) == pytest.approx(lagged(asked, ratio * lag, dt), abs=1e-9)


def test_a_torque_that_rests_is_sent_as_it_is():
    commands = sent(RotorLead(True, 0.01), Vehicle(rotor_time_constant=0.05), np.tile([0.1, -0.2, 0.03], (200, 1)))
    assert commands[-1] == pytest.approx([0.1, -0.2, 0.03], abs=1e-12)
    # the first step is that of the exact inverse: (1 - e^(-dt/T_f)) / (1 - e^(-dt/T_r))
    assert commands[0] == pytest.approx(4.6230 * np.array([0.1, -0.2, 0.03]), rel=1e-4)


@pytest.mark.parametrize("lag", [0.0, 0.009, 0.01])
def test_rotors_that_are_fast_enough_get_the_law_s_bits(lag):
    asked = np.random.default_rng(3).uniform(-0.5, 0.5, (40, 3))
    assert np.array_equal(sent(RotorLead(True, 0.01), Vehicle(rotor_time_constant=lag), asked), asked)


def test_what_is_shown_is_nothing_where_nothing_is_led():
    wrench = Wrench(5.0, Vec3(0.1, 0.0, 0.0))
    assert ahead_of_rotors(RotorLead(True, 0.02), Vehicle(), Given(), wrench, DT) == (
        wrench,
        Given(wrench.torque_b),
        LeadShown(),
    )
