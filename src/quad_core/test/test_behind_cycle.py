"""When a reference asks for more than the vehicle has, step by step."""

import math
from typing import NamedTuple

import pytest

from quad_core.cycle import Behind, behind_check, distance_behind, followed, limits_met, never_behind
from quad_core.types import PositionInternals, Vec3

FLAGS = ("velocity_limited", "acceleration_limited", "tilt_limited", "thrust_limited", "descent_limited")


@pytest.mark.parametrize("flag", FLAGS)
def test_every_limit_counts_and_only_beyond_a_metre(flag):
    assert distance_behind(PositionInternals(position_error=Vec3(2.0, -1.0, 2.0), **{flag: True})) == 3.0
    assert distance_behind(PositionInternals(position_error=Vec3(0.0, 0.0, -0.99), **{flag: True})) == 0.0


def test_far_without_a_limit_is_no_fault_of_the_reference():
    assert distance_behind(PositionInternals(position_error=Vec3(9.0, 0.0, 0.0), adaptation_frozen=True)) == 0.0


def test_the_limits_met_are_named():
    assert limits_met(PositionInternals(tilt_limited=True, thrust_limited=True)) == "tilt, thrust"


def test_no_other_field_is_a_limit():
    assert {name for name in PositionInternals._fields if "limited" in name} == {*FLAGS}


def test_a_law_without_limits_is_not_judged_by_them():
    class Own(NamedTuple):
        position_error: Vec3 = Vec3()

    assert behind_check(Own) is never_behind
    assert never_behind(Own(Vec3(9.0, 0.0, 0.0))) == 0.0
    assert behind_check(PositionInternals) is distance_behind


def spell(distances):
    """Return after which of ``distances`` (time in s, distance in m) the reference first counts as infeasible."""
    behind, first = Behind(), None
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
    behind = Behind(10**9, 2 * 10**9, 3.0, 5 * 10**9)
    assert followed(behind, 0.0, 10**10) == Behind(-1, -1, 0.0, 5 * 10**9)
