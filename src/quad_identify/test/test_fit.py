"""Intervals hold the truth as often as they say."""

import numpy as np
import pytest
from samples import log_of

from quad_identify.fit import covariance_of, scatter, start
from quad_identify.model import AT, Model
from quad_identify.record import checked, gridded


@pytest.mark.parametrize("windows", [60, 280])
def test_an_interval_of_95_percent_of_a_mean_of_white_noise_holds_it_in_95_percent(windows):
    held = []
    for noise in np.random.default_rng(1).standard_normal((2000, windows, 1)):
        covariance, widened = scatter(noise - noise.mean())
        held.append(abs(noise.sum()) <= 1.96 * widened * np.sqrt(covariance[0, 0]))
    assert np.mean(held) == pytest.approx(0.95, abs=0.012)


def test_a_lag_within_a_sample_of_the_log_has_an_interval():
    model, lag = Model(gridded(checked(log_of(every=8, motors_every=8))[0])), AT["rotor_time_constant"]
    p = start(model)
    p[lag] = 1e-4  # its bound, where an answer within a sample has no slope
    covariance, _ = covariance_of(model, p, model.free(), np.ones(len(model.residuals(p)), dtype=bool), 1.0)
    assert 1e-4 < np.sqrt(covariance[lag, lag]) < 0.02
