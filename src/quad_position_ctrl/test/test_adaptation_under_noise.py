"""Eq. 37 integrates a square, so noise alone raises xi_hat: by how much, and what dead zone and leak leave of it."""

import math
import random

import pytest

from quad_position_ctrl.backstepping import AxisGains, adapting_error, updated_gain

DT, SECONDS, ALPHA, START = 0.01, 80.0, 2.5, 1.0


def gain_after(noise_sd, dead_zone=0.0, leak=0.0, error=0.0, bound=math.inf):
    """Return xi_hat after 80 s of e_8 = ``error`` plus white Gaussian noise, none of it beyond ``bound``."""
    gains = AxisGains(
        adaptation_rate=ALPHA, initial_gain=START, max_gain=1e9, adaptation_leak=leak, adaptation_dead_zone=dead_zone
    )
    rng, gain = random.Random(7), START
    for _ in range(round(SECONDS / DT)):
        noise = min(max(rng.gauss(0.0, noise_sd), -bound), bound)
        gain = updated_gain(gains, gain, error + noise, DT)
    return gain


@pytest.mark.parametrize("noise_sd", [0.02, 0.047, 0.2])
def test_eq37_is_pumped_up_by_alpha_times_the_variance(noise_sd):
    grown = gain_after(noise_sd) - START
    assert grown == pytest.approx(ALPHA * noise_sd**2 * SECONDS, rel=0.06)


def test_a_dead_zone_of_three_deviations_leaves_a_thousandth():
    """E (abs(n) - 3 sd)^2 over abs(n) > 3 sd is 4.0e-4 sd^2 for Gaussian n: 2 (10 Q(3) - 3 phi(3))."""
    pumped = gain_after(0.2) - START
    assert 0.0 < gain_after(0.2, dead_zone=0.6) - START < 1e-3 * pumped


def test_bounded_noise_inside_the_dead_zone_moves_no_bit():
    assert gain_after(0.2, dead_zone=0.5, bound=0.5) == START


@pytest.mark.parametrize(("dead_zone", "error", "bound"), [(0.0, 0.0, 0.3), (0.1, 0.2, 0.4), (0.2, 0.5, 0.1)])
def test_with_a_leak_the_gain_stays_below_its_bound(dead_zone, error, bound):
    """xi_hat - xi_hat(0) <= alpha max(abs(e_8) - dead zone, 0)^2 / leak at every time, whatever the noise."""
    leak = 0.5
    limit = ALPHA * max(error + bound - dead_zone, 0.0) ** 2 / leak
    assert START < gain_after(1.0, dead_zone, leak, error, bound) <= START + limit


def test_an_error_beyond_the_dead_zone_counts_less_the_zone():
    assert adapting_error(-0.75, 0.5) == 0.25
    assert adapting_error(0.75, 0.5) == 0.25
    assert adapting_error(0.5, 0.5) == 0.0
    assert adapting_error(-1.5, 0.0) == 1.5
