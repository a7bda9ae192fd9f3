"""NamedTuples as flat numbers and back, and whether they are finite."""

import math
from typing import Annotated, NamedTuple

import pytest

from quad_core.compilation import compiled
from quad_core.records import Leaf, builder, field_kinds, finite_check, flattener, leaves, numbers_finite
from quad_core.types import Vec3, Wrench


class Mixed(NamedTuple):
    inside: Wrench
    count: Annotated[int, "a count"]
    flag: bool


VALUE = Mixed(Wrench(1.0, Vec3(2.0, 3.0, 4.0)), 5, True)


def test_leaves_are_all_numbers_in_order_with_their_types():
    expected = [("inside.thrust", float), ("inside.torque_b.x", float), ("inside.torque_b.y", float)]
    assert leaves(Mixed) == [
        Leaf(*pair) for pair in [*expected, ("inside.torque_b.z", float), ("count", int), ("flag", bool)]
    ]
    assert leaves(float) == [Leaf("", float)]
    assert field_kinds(Mixed) == {"inside": Wrench, "count": int, "flag": bool}


def test_a_value_is_flattened_in_the_order_of_its_leaves():
    assert flattener(Mixed)(VALUE) == (1.0, 2.0, 3.0, 4.0, 5, True)
    assert flattener(float)(7.0) == (7.0,)


def test_a_value_is_built_again_from_its_numbers():
    assert builder(Mixed)((1.0, 2.0, 3.0, 4.0, 5, True)) == VALUE
    assert builder(float)((7.0,)) == 7.0
    assert isinstance(builder(Mixed)(flattener(Mixed)(VALUE)).inside.torque_b, Vec3)


def test_what_is_no_number_is_refused_by_name():
    class Named(NamedTuple):
        title: str

    class Outer(NamedTuple):
        named: Named

    with pytest.raises(TypeError, match=r"named\.title: found <class 'str'>, expected a number"):
        leaves(Outer)


def test_large_finite_numbers_are_finite_though_their_sum_is_not():
    assert finite_check(Wrench)(Wrench(1e308, Vec3(1e308, 1e308, 0.0)))
    assert numbers_finite((1e308, 1e308))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(4))
def test_the_check_of_a_class_sees_each_number_in_both_engines(bad, place):
    numbers = [1.0, -2.0, 3e300, 4.0, 5, True]
    check, fast = finite_check(Mixed), compiled(finite_check(Mixed))
    assert check(builder(Mixed)(numbers))
    assert fast(builder(Mixed)(numbers))
    numbers[place] = bad
    assert not check(builder(Mixed)(numbers))
    assert not fast(builder(Mixed)(numbers))
