"""Eq. 54 integrates abs(s), so noise alone raises Q_hat: by how much, and what a dead zone leaves of it."""

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


def estimate_after(noise_sd, dead_zone):
    """Return Q_hat of an axis at rest whose rate error is white noise; without a surface integral."""
    gains = AxisGains(dead_zone=dead_zone, adaptation_constant=RATE, max_estimate=1e9, max_surface_integral=0.0)
    rng, memory = random.Random(3), AxisMemory(0.0, Estimates(0.0, 0.0, 0.0))
    for _ in range(round(SECONDS / DT)):
        state = AxisState(0.2, 0.0, 0.0, rng.gauss(0.0, noise_sd), 0.0, 0.0)
        control = axis_control(gains, memory, state, angle_exponent(state.error), AdaptationForm.ABS)
        memory = next_axis_memory(gains, memory, control, False, DT)
    return memory.estimates.constant


@pytest.mark.parametrize("noise_sd", [0.1, 0.4])
def test_eq54_is_pumped_up_by_the_mean_size_of_the_noise(noise_sd):
    """Without a dead zone by Delta E abs(n) = Delta sd sqrt(2 / pi) a second."""
    grown = estimate_after(noise_sd, 0.0)
    assert grown == pytest.approx(RATE * noise_sd * math.sqrt(2.0 / math.pi) * SECONDS, rel=0.03)


def test_the_printed_dead_zone_holds_only_noise_that_is_smaller():
    assert estimate_after(0.05, 0.3) == 0.0
    assert estimate_after(0.4, 0.3) > 5.0
