"""Intervals hold the truth as often as they say."""

import numpy as np
import pytest

from quad_identify.fit import scatter


@pytest.mark.parametrize("windows", [60, 280])
def test_an_interval_of_95_percent_of_a_mean_of_white_noise_holds_it_in_95_percent(windows):
    held = []
    for noise in np.random.default_rng(1).standard_normal((2000, windows, 1)):
        covariance, widened = scatter(noise - noise.mean())
        held.append(abs(noise.sum()) <= 1.96 * widened * np.sqrt(covariance[0, 0]))
    assert np.mean(held) == pytest.approx(0.95, abs=0.012)
