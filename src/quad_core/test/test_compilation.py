"""One text for two engines: compiled it gives the same bits, and what cannot be compiled is named."""

import math
import random

import pytest

from quad_core import geometry
from quad_core.compilation import compiled
from quad_core.types import Quat, Vec3

CHANCE = random.Random(64)


def inner(v: Vec3) -> float:
    return math.exp(-abs(v.x)) + math.atan2(v.y, v.z)


def outer(v: Vec3, gain: float) -> Vec3:
    return Vec3(gain * inner(v), abs(v.y) ** gain, math.tanh(v.z) / gain)


def through_a_module(v: Vec3) -> Quat:
    return geometry.quaternion_from_euler(v)


def bits(value):
    return [float(number).hex() for number in value]


def test_callees_are_compiled_along_and_every_bit_is_the_same():
    fast = compiled(outer)
    for _ in range(2000):
        v, gain = Vec3(*(CHANCE.uniform(-5.0, 5.0) for _ in range(3))), CHANCE.uniform(0.1, 3.0)
        assert bits(fast(v, gain)) == bits(outer(v, gain))


def test_division_by_zero_does_not_raise_in_compiled_text():
    assert math.isinf(compiled(outer)(Vec3(0.0, 1.0, 1.0), 0.0).z)


def test_a_function_called_through_a_module_is_refused_by_name():
    with pytest.raises(TypeError, match=r"through_a_module: import functions from geometry by name"):
        compiled(through_a_module)


def test_only_plain_functions_are_taken():
    with pytest.raises(TypeError, match="expected a plain function"):
        compiled(math.sin)
