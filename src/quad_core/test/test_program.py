"""A program's values: what goes in comes out, run by CPython."""

import math
from typing import Annotated, NamedTuple

import pytest

from quad_core.program import Call, Interpreted, Leaf, Program, all_finite, field_kinds, flattener, leaves
from quad_core.types import Vec3, Wrench


class Mixed(NamedTuple):
    inside: Wrench
    count: Annotated[int, "told elsewhere"]
    flag: bool


VALUE = Mixed(Wrench(1.0, Vec3(2.0, 3.0, 4.0)), 5, True)


def halves(number: float) -> tuple[float, float]:
    return 0.5 * number, 0.25 * number


def doubled(number: float) -> float:
    return 2.0 * number


PROGRAM = Program(
    "halves",
    {"whole": float, "half": float, "quarter": float},
    {"step": (Call(halves, ("whole",), ("half", "quarter")), Call(doubled, ("quarter",), ("whole",)))},
)


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


def test_what_is_only_remembered_may_be_anything():
    class Memory(NamedTuple):
        past: list[float]

    def remember(memory: Memory) -> Memory:
        return Memory([*memory.past, 1.0])

    stepper = Interpreted(Program("any", {"memory": Memory}, {"step": (Call(remember, ("memory",), ("memory",)),)}))
    stepper.put("memory", Memory([]))
    stepper.run("step")
    assert stepper.get("memory").past == [1.0]


def test_what_is_no_number_is_refused_by_name():
    class Named(NamedTuple):
        title: str

    class Outer(NamedTuple):
        named: Named

    with pytest.raises(TypeError, match=r"named\.title: found <class 'str'>, expected a number"):
        leaves(Outer)


def test_calls_are_made_in_order_on_the_values_by_name():
    stepper = Interpreted(PROGRAM)
    stepper.put("whole", 8.0)
    stepper.run("step")
    assert [stepper.get(name) for name in PROGRAM.slots] == [4.0, 4.0, 2.0]
    assert stepper.numbers("half") == (4.0,)
    stepper.copy("quarter", "half")
    assert stepper.get("half") == 2.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_non_finite_is_seen_wherever_it_stands(bad):
    assert not all_finite(Wrench(1.0, Vec3(0.0, bad, 0.0)))
    assert not all_finite(Wrench(bad, Vec3(0.0, 0.0, 0.0)))
    assert not all_finite((1.0, (2.0, (3.0, bad)), -bad))


def test_large_finite_numbers_are_finite_though_their_sum_is_not():
    assert all_finite(Wrench(1e308, Vec3(1e308, 1e308, 0.0)))
