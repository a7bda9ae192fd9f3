"""Arithmetic of three-vectors against NumPy, and the clamp."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quad_core.compilation import compiled
from quad_core.geometry import ZERO, add, clamp, cross, dot, negate, norm, scale, subtract
from quad_core.types import Vec3

PART = st.floats(-1e3, 1e3, allow_subnormal=False)
VECTOR = st.builds(Vec3, PART, PART, PART)
NUMBER = st.floats(allow_nan=False)


@given(a=VECTOR, b=VECTOR, factor=PART)
def test_numpy_says_the_same(a, b, factor):
    u, v = np.array(a), np.array(b)
    assert add(a, b) == tuple(u + v)
    assert subtract(a, b) == tuple(u - v)
    assert negate(a) == tuple(-u)
    assert scale(factor, a) == tuple(factor * u)
    assert dot(a, b) == pytest.approx(np.dot(u, v), rel=1e-12, abs=1e-9)
    assert cross(a, b) == pytest.approx(np.cross(u, v), rel=1e-12, abs=1e-9)
    assert norm(a) == pytest.approx(np.linalg.norm(u), rel=1e-12)
    assert add(a, ZERO) == a


def test_the_axes_are_right_handed():
    x, y, z = Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0)
    assert (cross(x, y), cross(y, z), cross(z, x)) == (z, x, y)


@given(value=NUMBER, low=NUMBER, high=NUMBER)
def test_clamp_moves_into_the_range_and_no_farther(value, low, high):
    low, high = sorted((low, high))
    found = clamp(value, low, high)
    assert low <= found <= high
    assert found == value or found in (low, high)
    assert (found == value) == (low <= value <= high)


def test_clamp_leaves_a_nan_to_be_seen():
    assert math.isnan(clamp(math.nan, -1.0, 1.0))


def test_compiled_clamp_is_the_same():
    pytest.importorskip("numba")
    assert [compiled(clamp)(value, -1.0, 2.0) for value in (-5.0, -1.0, 0.5, 2.0, 9.0)] == [-1.0, -1.0, 0.5, 2.0, 2.0]
