"""Steps and seconds: correctly rounded, and no step too many or too few at an edge."""

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from quad_core.cycle import seconds, steps_to_cover

PERIODS = st.sampled_from([100_000, 1_000_000, 2_000_000, 2_500_000, 3_333_333, 10_000_000])


@given(steps=st.integers(0, 10_000_000), period=PERIODS)
def test_seconds_are_the_nearest_float_to_the_exact_time(steps, period):
    assert seconds(steps, period) == float(Fraction(steps * period, 10**9))


@given(steps=st.integers(1, 1_000_000), period=PERIODS)
def test_a_duration_of_whole_steps_needs_just_those(steps, period):
    assert steps_to_cover(seconds(steps, period), period) == steps


@given(steps=st.integers(1, 1_000_000), part=st.floats(1e-3, 0.999), period=PERIODS)
def test_a_part_of_a_step_needs_one_more(steps, part, period):
    duration = (steps + part) * period / 1e9
    assert steps_to_cover(duration, period) == steps + 1


def test_a_flight_has_at_least_one_step():
    assert steps_to_cover(0.0, 2_000_000) == 1
    assert steps_to_cover(1e-12, 2_000_000) == 1


def test_by_hand():
    assert seconds(3, 2_000_000) == 0.006
    assert steps_to_cover(80.0, 2_000_000) == 40_000
    assert steps_to_cover(0.0061, 2_000_000) == 4
