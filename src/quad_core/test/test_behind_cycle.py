"""When a reference asks for more than the vehicle has, step by step."""

from typing import NamedTuple

import pytest

from quad_core.cycle import Behind, behind_check, followed, is_behind, never_behind
from quad_core.types import PositionInternals, Vec3

FLAGS = ("velocity_limited", "acceleration_limited", "tilt_limited", "thrust_limited", "descent_limited")


@pytest.mark.parametrize("flag", FLAGS)
def test_every_limit_counts_and_only_beyond_a_metre(flag):
    assert is_behind(PositionInternals(position_error=Vec3(0.6, -0.6, 0.6), **{flag: True}))
    assert not is_behind(PositionInternals(position_error=Vec3(0.0, 0.0, -0.99), **{flag: True}))


def test_far_without_a_limit_is_no_fault_of_the_reference():
    assert not is_behind(PositionInternals(position_error=Vec3(9.0, 0.0, 0.0), adaptation_frozen=True))


def test_no_other_field_is_a_limit():
    assert {name for name in PositionInternals._fields if "limited" in name} == {*FLAGS}


def test_a_law_without_limits_is_not_judged_by_them():
    class Own(NamedTuple):
        position_error: Vec3 = Vec3()

    assert behind_check(Own) is never_behind
    assert not never_behind(Own(Vec3(9.0, 0.0, 0.0)))
    assert behind_check(PositionInternals) is is_behind


def test_only_a_spell_of_more_than_two_seconds_without_a_break_counts():
    behind = Behind()
    times = [0.0, 1.9, 2.0, 2.1, 4.0, 4.1, 4.2, 9.0]
    now = [True, True, False, True, True, True, True, True]
    seen = []
    for time, is_far in zip(times, now, strict=True):
        behind = followed(behind, is_far, round(time * 1e9))
        seen.append(behind.infeasible_ns)
    # from 2.1 s on: 4.1 s is exactly 2 s later and not more
    assert seen == [-1] * 6 + [4_200_000_000] * 2
    assert followed(behind, False, 10**10) == Behind(-1, 4_200_000_000)
