"""Steps and seconds, where the laws may be called, and when a reference asks for more than the vehicle has."""

import math
from fractions import Fraction
from typing import NamedTuple

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from quad_core.cycle import (
    ReferenceLag,
    distance_behind,
    followed,
    is_flyable,
    lag_check,
    limits_met,
    never_behind,
    seconds,
    steps_to_cover,
)
from quad_core.types import PositionInternals, Quat, Vec3, VehicleState

PERIODS = st.sampled_from([100_000, 1_000_000, 2_000_000, 2_500_000, 3_333_333, 10_000_000])


@given(steps=st.integers(0, 10_000_000), period=PERIODS)
def test_seconds_are_the_nearest_float_to_the_exact_time(steps, period):
    assert seconds(steps, period) == float(Fraction(steps * period, 10**9))


@given(steps=st.integers(1, 1_000_000), period=PERIODS)
@example(67, 2_000_000)  # 0.134 s over the period is more than 67
def test_a_duration_of_whole_steps_needs_just_those(steps, period):
    assert steps_to_cover(seconds(steps, period), period) == steps


@given(steps=st.integers(1, 1_000_000), part=st.floats(1e-3, 0.999), period=PERIODS)
def test_a_part_of_a_step_needs_one_more(steps, part, period):
    duration = (steps + part) * period / 1e9
    assert steps_to_cover(duration, period) == steps + 1


def test_a_flight_has_at_least_one_step():
    assert steps_to_cover(0.0, 2_000_000) == 1
    assert steps_to_cover(1e-12, 2_000_000) == 1


def state_with(index, value):
    numbers = [0.0] * 9 + [1.0] + [0.0] * 3
    numbers[index] = value
    return VehicleState(Vec3(*numbers[:3]), Vec3(*numbers[3:6]), Quat(*numbers[6:10]), Vec3(*numbers[10:]))


BOUNDS = [1e4] * 3 + [1e3] * 3 + [None] * 4 + [1e3] * 3


@pytest.mark.parametrize("index", range(13))
def test_every_number_is_checked(index):
    for bad in (math.nan, math.inf, -math.inf, 1.1e4, -1.1e4):
        assert not is_flyable(state_with(index, bad))
    bound = BOUNDS[index]
    if bound is not None:
        assert is_flyable(state_with(index, bound))
        assert is_flyable(state_with(index, -bound))
        assert not is_flyable(state_with(index, math.nextafter(bound, math.inf)))


def test_quaternion_must_have_length_one():
    half = Quat(0.5, -0.5, 0.5, -0.5)
    assert is_flyable(VehicleState(q_wb=half))
    for scale, verdict in ((1.0009, True), (0.9991, True), (1.0011, False), (0.9989, False), (0.0, False)):
        assert is_flyable(VehicleState(q_wb=Quat(*(scale * number for number in half)))) == verdict


FLAGS = ("velocity_limited", "acceleration_limited", "tilt_limited", "thrust_limited", "descent_limited")


@pytest.mark.parametrize("flag", FLAGS)
def test_every_limit_counts_and_only_beyond_a_metre(flag):
    assert distance_behind(PositionInternals(position_error=Vec3(2.0, -1.0, 2.0), **{flag: True})) == 3.0
    assert distance_behind(PositionInternals(position_error=Vec3(0.0, 0.0, -0.99), **{flag: True})) == 0.0


def test_the_limits_met_are_named_and_without_one_far_is_no_fault_of_the_reference():
    assert distance_behind(PositionInternals(position_error=Vec3(9.0, 0.0, 0.0), adaptation_frozen=True)) == 0.0
    assert limits_met(PositionInternals(tilt_limited=True, thrust_limited=True)) == "tilt, thrust"


def test_a_law_without_limits_is_not_judged_by_them():
    class Own(NamedTuple):
        position_error: Vec3 = Vec3()

    assert lag_check(Own) is never_behind
    assert never_behind(Own(Vec3(9.0, 0.0, 0.0))) == 0.0
    assert lag_check(PositionInternals) is distance_behind


def spell(distances):
    """Return after which of ``distances`` (time in s, distance in m) the reference first counts as infeasible."""
    behind, first = ReferenceLag(), None
    for time, distance in distances:
        behind = followed(behind, distance, round(time * 1e9))
        if behind.infeasible_ns >= 0 and first is None:
            first = time
    return first


def test_only_a_spell_of_more_than_two_seconds_without_a_break_counts():
    times = [0.0, 1.9, 2.0, 2.1, 4.0, 4.1, 4.2, 9.0]
    # from 2.1 s on: 4.1 s is exactly 2 s later and not more
    assert spell((t, 0.0 if t == 2.0 else 3.0) for t in times) == 4.2


def test_a_vehicle_that_comes_nearer_follows_however_long_it_takes():
    # 0.06 m/s: 0.1 m each 1.7 s
    assert spell((0.01 * k, 13.0 - 0.0006 * k) for k in range(15_000)) is None
    # 0.04 m/s: 0.1 m each 2.5 s
    assert spell((0.01 * k, 13.0 - 0.0004 * k) for k in range(15_000)) == pytest.approx(2.01)


def test_coming_back_to_a_distance_reached_before_is_no_progress():
    """A figure that is too quick: the distance falls and rises with each round of 2.2 s."""
    rounds = ((0.01 * k, 3.0 + math.cos(2.0 * math.pi * k / 220)) for k in range(2000))
    # the least is reached after half a round
    assert spell(rounds) == pytest.approx(1.1 + 2.0, abs=0.2)


def test_it_stays_infeasible_after_the_spell():
    behind = ReferenceLag(10**9, 2 * 10**9, 3.0, 5 * 10**9)
    assert followed(behind, 0.0, 10**10) == ReferenceLag(-1, -1, 0.0, 5 * 10**9)
    assert followed(behind, 3.0, 10**10).infeasible_ns == 5 * 10**9
