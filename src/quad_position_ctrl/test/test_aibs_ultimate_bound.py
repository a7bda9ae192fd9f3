"""The bound of docs/explanation/stability.md with leak, dead zone, projection and freezing; one axis."""

import math
import random

import numpy as np
import pytest

from quad_position_ctrl import backstepping as law

XI7, DRAG, DT = 4.25, -0.3, 1e-3


def flown(gains, bound, seed, seconds=12.0, freezing=False, start=(1.0, 0.0, 0.0)):
    """Return (e_7, e_8, Gamma, xi_hat, moved) by step under a disturbance that jumps within ``bound``.

    ``freezing``: Gamma and xi_hat rest for random stretches; ``moved`` says in which steps they did not.
    """
    rng = random.Random(seed)
    p, v, integral = start
    gain, d, frozen, rows = gains.initial_gain, 0.0, False, []
    for k in range(round(seconds / DT)):
        if k % 250 == 0:
            d = rng.choice((-bound, bound, rng.uniform(-bound, bound)))
            frozen = freezing and rng.random() < 0.5
        e8 = v - law.correction_velocity(XI7, gains.integral_gain, p, integral)
        rows.append((p, e8, integral, gain, not frozen))
        u = law.acceleration_command(XI7, gains.integral_gain, gain, DRAG, p, e8, integral, v, 0.0, 0.0)
        if not frozen:
            integral = law.next_integral(integral, p, gains.max_integral, DT)
            gain = law.updated_gain(gains, gain, e8, DT)
        p, v = p + DT * v, v + DT * (DRAG * v + u + d)
    return np.array(rows)


GAINS = law.AxisGains(integral_gain=0.5, max_integral=0.3, initial_gain=5.0, max_gain=8.0, adaptation_leak=0.4)
FORMS = {
    "leak": GAINS._replace(max_gain=1e9, max_integral=1e9),
    "projection": GAINS,
    "dead zone": GAINS._replace(adaptation_dead_zone=0.2),
}


def rate_limit(lowest_gain, e7, e8, bound):
    """Return -xi_7 e_7^2 - xi_low e_8^2 + D abs(e_8), which W' of W = (e_7^2 + k Gamma^2 + e_8^2) / 2 never exceeds."""
    return -XI7 * e7 * e7 - lowest_gain * e8 * e8 + bound * np.abs(e8)


@pytest.mark.parametrize("form", FORMS)
def test_the_rate_stays_below_its_limit_whatever_moves_the_gain(form):
    gains, bound = FORMS[form], 2.0
    rows = flown(gains, bound, 4)
    e7, e8, integral, gain, _ = rows.T
    assert gain.min() >= gains.initial_gain
    values = 0.5 * (e7 * e7 + gains.integral_gain * integral * integral + e8 * e8)
    slopes = np.diff(values) / DT
    limits = rate_limit(gains.initial_gain, e7, e8, bound)
    # the Euler step adds DT/2 times a second derivative
    assert (slopes - limits[:-1]).max() < 0.02 * (1.0 + np.abs(slopes).max())
    assert slopes.max() > 0.1


@pytest.mark.parametrize("seed", range(4))
def test_in_the_end_the_error_is_below_its_bound(seed):
    """sqrt(k G^2 + D^2 / (c xi_low)) with c = min(2 xi_7, xi_low), here xi_low."""
    bound, lowest = 2.0, GAINS.initial_gain
    e7, e8 = flown(GAINS, bound, seed).T[:2]
    limit = math.sqrt(GAINS.integral_gain * GAINS.max_integral**2 + bound * bound / (lowest * lowest))
    assert np.hypot(e7, e8)[6000:].max() < limit


def test_while_the_integral_rests_the_rate_has_one_more_term():
    """-k Gamma e_7, of any sign: at most k G abs(e_7). Nothing else is lost by freezing."""
    bound, k = 2.0, GAINS.integral_gain
    rows = flown(GAINS, bound, 2, freezing=True)
    e7, e8, integral, _, moved = rows.T
    values = 0.5 * (e7 * e7 + k * integral * integral + e8 * e8)
    slopes = np.diff(values) / DT
    limits = rate_limit(5.0, e7, e8, bound)
    limits += np.where(moved > 0.5, 0.0, k * GAINS.max_integral * np.abs(e7))
    assert (slopes - limits[:-1]).max() < 0.02 * (1.0 + np.abs(slopes).max())
    assert 0.1 < (moved < 0.5).mean() < 0.9


@pytest.mark.parametrize("gain", [7.0, 8.0, 10.0])
def test_a_cross_term_makes_the_integral_contract_too(gain):
    """V = W + eps e_7 Gamma falls in every direction without d, for all gains that `tuned` allows."""
    k, eps = 0.01, 0.0045
    system = np.array([[-XI7, 1.0, -k], [-1.0, -gain, 0.0], [1.0, 0.0, 0.0]])
    form = np.array([[0.5, 0.0, 0.5 * eps], [0.0, 0.5, 0.0], [0.5 * eps, 0.0, 0.5 * k]])
    assert np.linalg.eigvalsh(form).min() > 0.0
    assert np.linalg.eigvalsh(system.T @ form + form @ system).max() < 0.0
