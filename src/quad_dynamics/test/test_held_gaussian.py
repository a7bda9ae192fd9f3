"""The disturbance of section 4: size, bound, hold, independence, and the same start at any length."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_cases import ASYMMETRIC
from scipy.stats import norm

from quad_core.cycle import seconds
from quad_core.types import Conditions
from quad_dynamics import held_gaussian, no_disturbance
from quad_dynamics.held_gaussian import Parameters

INERTIA = np.array([1.3, 1.3, 1.3, 0.011, 0.017, 0.026])
LONG = held_gaussian.draw(Parameters(), ASYMMETRIC, 5, 400_000.0) / INERTIA
COUNT = len(LONG)


def test_defaults_are_those_fixed_for_the_paper():
    assert Parameters() == (0.5, 1.5, 2.0 / 3.0, 2.0, 2.0)


def test_size_and_bound_of_each_channel():
    # a normal clipped at c = 3 sd: variance of the clipped variable in units of sd^2
    c = 3.0
    variance = (2 * norm.cdf(c) - 1) - 2 * c * norm.pdf(c) + 2 * c * c * norm.sf(c)
    sd, clip = np.array([0.5] * 3 + [2 / 3] * 3), np.array([1.5] * 3 + [2.0] * 3)
    np.testing.assert_allclose(LONG.mean(axis=0) / sd, 0.0, atol=4.0 / np.sqrt(COUNT))
    np.testing.assert_allclose(LONG.std(axis=0) / sd, np.sqrt(variance), atol=4.0 / np.sqrt(2 * COUNT))
    np.testing.assert_allclose(np.abs(LONG).max(axis=0), clip, rtol=1e-14)
    clipped = np.isclose(np.abs(LONG), clip, rtol=1e-13).mean(axis=0)
    expected = 2 * norm.sf(c)
    np.testing.assert_allclose(clipped, expected, atol=4.0 * np.sqrt(expected / COUNT))


def test_inner_values_are_gaussian():
    for column, sd in zip(LONG.T, [0.5] * 3 + [2 / 3] * 3, strict=True):
        for quantile in (-2.0, -1.0, 0.0, 1.0, 2.0):
            assert np.mean(column < quantile * sd) == pytest.approx(norm.cdf(quantile), abs=4.0 * 0.5 / np.sqrt(COUNT))


def test_channels_and_successive_values_are_uncorrelated():
    together = np.corrcoef(LONG.T) - np.eye(6)
    assert np.abs(together).max() < 4.5 / np.sqrt(COUNT)
    for column in LONG.T:
        assert abs(np.corrcoef(column[:-1], column[1:])[0, 1]) < 4.5 / np.sqrt(COUNT)


def test_a_channel_depends_only_on_seed_and_channel():
    base = held_gaussian.draw(Parameters(), ASYMMETRIC, 7, 50.0)
    louder = held_gaussian.draw(Parameters(acceleration_sd=0.25), ASYMMETRIC, 7, 50.0)
    assert np.array_equal(base[:, 3:], louder[:, 3:])
    assert not np.array_equal(base[:, :3], louder[:, :3])
    other = held_gaussian.draw(Parameters(), ASYMMETRIC, 8, 50.0)
    assert not np.isclose(base, other).any()
    heavier = held_gaussian.draw(Parameters(), ASYMMETRIC._replace(mass=2.6), 7, 50.0)
    np.testing.assert_allclose(heavier[:, :3], 2.0 * base[:, :3])
    assert np.array_equal(base, held_gaussian.draw(Parameters(), ASYMMETRIC, 7, 50.0))


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**63 - 1), st.floats(0.0, 300.0), st.floats(0.0, 300.0))
def test_a_longer_flight_begins_like_a_shorter_one(seed, first, second):
    short, long = sorted((first, second))
    a = held_gaussian.draw(Parameters(), ASYMMETRIC, seed, short)
    b = held_gaussian.draw(Parameters(), ASYMMETRIC, seed, long)
    assert np.array_equal(a, b[: len(a)])
    assert a.shape == (int(short / 2.0 + 1e-9) + 1, 6)


@pytest.mark.parametrize("period", [2_000_000, 1_000_000, 2_500_000, 3_000_000, 10_000_000])
def test_each_value_is_held_for_two_seconds_of_steps(period):
    table = held_gaussian.draw(Parameters(), ASYMMETRIC, 3, 40.0)
    for step in range(40_000_000_000 // period):
        force, torque, *_ = held_gaussian.sample(Parameters(), table, seconds(step, period))
        assert (*force, *torque) == tuple(table[step * period // 2_000_000_000])


def test_outside_the_table_the_nearest_row_acts_and_numbers_are_floats():
    table = held_gaussian.draw(Parameters(hold=0.5), ASYMMETRIC, 3, 2.0)
    assert held_gaussian.sample(Parameters(hold=0.5), table, -1.0)[0] == tuple(table[0, :3])
    assert held_gaussian.sample(Parameters(hold=0.5), table, 1e6)[1] == tuple(table[-1, 3:])
    for time, row in ((0.0, 0), (0.7, 1), (1.9, 3)):
        found = held_gaussian.sample(Parameters(hold=0.5), table, time)
        assert (found.force_w + found.torque_b) == tuple(table[row].tolist())
        assert {type(v) for part in found[:2] for v in part} == {float}


def test_calm_is_nothing():
    table = no_disturbance.draw(no_disturbance.Parameters(), ASYMMETRIC, 1, 10.0)
    assert table.shape == (1, 6)
    assert not table.any()
    assert no_disturbance.sample(no_disturbance.Parameters(), table, 5.0) == Conditions()
