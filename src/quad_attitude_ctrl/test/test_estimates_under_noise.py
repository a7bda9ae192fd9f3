"""Eq. 54 integrates abs(s), so noise alone raises Q_hat: by how much, and what dead zone and leak leave of it."""

import math
import random

import pytest

from quad_attitude_ctrl.sliding_control import (
    AdaptationForm,
    AxisGains,
    AxisMemory,
    AxisState,
    Estimates,
    angle_exponent,
    axis_control,
    next_axis_memory,
)

DT, SECONDS, RATE = 0.002, 20.0, 1.5


def estimates_after(noise_sd, dead_zone, leak, size=math.inf, seconds=SECONDS):
    """Return Q_hat of an axis at rest whose rate error is white noise, at most ``size``; without a surface integral."""
    gains = AxisGains(
        dead_zone=dead_zone,
        estimate_leak=leak,
        adaptation_constant=RATE,
        max_estimate=1e9,
        max_surface_integral=0.0,
    )
    rng, memory = random.Random(3), AxisMemory(0.0, Estimates(0.0, 0.0, 0.0))
    for _ in range(round(seconds / DT)):
        noise = min(max(rng.gauss(0.0, noise_sd), -size), size)
        state = AxisState(0.2, 0.0, 0.0, noise, 0.0, 0.0)
        control = axis_control(gains, memory, state, angle_exponent(state.error), AdaptationForm.ABS)
        memory = next_axis_memory(gains, memory, control, False, DT)
    return memory.estimates


@pytest.mark.parametrize("noise_sd", [0.1, 0.4])
def test_eq54_is_pumped_up_by_the_mean_size_of_the_noise(noise_sd):
    """Without a dead zone by Delta E abs(n) = Delta sd sqrt(2 / pi) a second."""
    grown = estimates_after(noise_sd, 0.0, 0.0).constant
    assert grown == pytest.approx(RATE * noise_sd * math.sqrt(2.0 / math.pi) * SECONDS, rel=0.03)


def test_the_printed_dead_zone_holds_only_noise_that_is_smaller():
    assert estimates_after(0.05, 0.3, 0.0).constant == 0.0
    assert estimates_after(0.4, 0.3, 0.0).constant > 5.0


@pytest.mark.parametrize("leak", [0.2, 2.0])
def test_with_a_leak_each_estimate_stays_below_its_bound(leak):
    """Q_hat <= Delta max abs(s) {1, abs(x_1), abs(x_2)} / leak at every time, and about Delta mean abs(s) / leak."""
    size, seconds = 0.5, 10.0
    found = estimates_after(0.4, 0.0, leak, size, seconds)
    assert 0.3 * RATE * size / leak < found.constant <= RATE * size / leak
    assert 0.0 < found.angle <= 0.2 * size / leak
    assert found.rate == 0.0
