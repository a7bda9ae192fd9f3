"""Dryden turbulence: scales and intensities of MIL-F-8785C, variance and spectrum of what is drawn."""

import math

import numpy as np
import pytest
from scipy.signal import welch

from quad_dynamics.dryden import Turbulence, low_altitude, realisation

SIGMA, SCALE = (1.0, 0.8, 0.5), (2.0, 2.0, 0.6)


def drawn(count, period, seed=1):
    streams = [np.random.default_rng([seed, axis]) for axis in range(3)]
    return realisation(Turbulence(SIGMA, SCALE), streams, count, period)


def test_low_altitude_form_by_hand():
    # 100 ft: shear term 0.177 + 0.0823 = 0.2593
    found = low_altitude(30.48, 10.0, 5.0)
    assert found.sigma == pytest.approx((1.0 / 0.2593**0.4, 1.0 / 0.2593**0.4, 1.0))
    length = 100.0 / 0.2593**1.2 * 0.3048
    assert found.scale == pytest.approx((length / 5.0, length / 5.0, 30.48 / 5.0))


def test_altitudes_are_held_where_the_form_holds():
    assert low_altitude(1.0, 5.0, 5.0) == low_altitude(3.048, 5.0, 5.0)
    top = low_altitude(304.8, 5.0, 5.0)
    # at 1000 ft both forms meet: isotropic, 0.177 + 0.823 = 1
    assert top.sigma == pytest.approx((0.5, 0.5, 0.5))
    assert top.scale == pytest.approx((60.96, 60.96, 60.96))


@pytest.mark.parametrize("period", [0.01, 0.1])
def test_variance_and_spectrum_at_two_step_sizes(period):
    values = drawn(round(12_000.0 / period) // 4, period)
    seconds = len(values) * period
    for axis in range(3):
        sigma, scale = SIGMA[axis], SCALE[axis]
        spread = 4.0 * math.sqrt(2.0 * scale / seconds)
        assert values[:, axis].std() == pytest.approx(sigma, rel=spread)
        frequencies, density = welch(values[:, axis], fs=1.0 / period, nperseg=round(40.0 / period))
        w = 2.0 * np.pi * frequencies
        tw = (scale * w) ** 2
        # one-sided over rad/s as stated; over Hz it is 2 pi times that
        if axis == 0:
            stated = sigma**2 * 2.0 * scale / np.pi / (1.0 + tw)
        else:
            stated = sigma**2 * scale / np.pi * (1.0 + 3.0 * tw) / (1.0 + tw) ** 2
        band = (w > 0.5) & (w < 0.3 / period) & (w < 20.0)
        ratio = density[band] / (2.0 * np.pi * stated[band])
        assert ratio.mean() == pytest.approx(1.0, abs=0.08)
        for part in np.array_split(ratio, 3):
            assert part.mean() == pytest.approx(1.0, abs=0.2)


def test_the_discretisation_is_exact_so_correlations_do_not_depend_on_the_step():
    """Autocorrelation of the transverse spectrum: sigma^2 exp(-t/T) (1 - t / (2 T))."""
    fine, coarse = drawn(300_000, 0.02, 2)[:, 1], drawn(300_000, 0.4, 3)[:, 1]
    for lag in (0.4, 2.0):
        expected = SIGMA[1] ** 2 * math.exp(-lag / 2.0) * (1.0 - lag / 4.0)
        for values, period, seconds in ((fine, 0.02, 6_000.0), (coarse, 0.4, 120_000.0)):
            shift = round(lag / period)
            found = np.mean(values[:-shift] * values[shift:])
            assert found == pytest.approx(expected, abs=4.0 * SIGMA[1] ** 2 * math.sqrt(2.0 * 2.0 / seconds))


def test_it_is_stationary_from_the_first_sample_and_prefix_stable():
    starts = np.array([drawn(1, 0.01, seed)[0] for seed in range(3000)])
    assert starts.std(axis=0) == pytest.approx(SIGMA, rel=4.0 / math.sqrt(6000))
    assert np.array_equal(drawn(50, 0.01), drawn(500, 0.01)[:50])
