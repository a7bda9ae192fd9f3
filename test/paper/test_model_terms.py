"""Rotations, vehicle and both plants against the transcription of Eqs. 1-17, term by term."""

import random

import paper_equations as eq
import pytest
from evaluation import evaluator

from quad_core.geometry import body_rates, body_z, euler_rates, quaternion_from_euler, rotate
from quad_core.types import Vec3
from quad_core.vehicle import Vehicle

pytestmark = pytest.mark.unit

RANDOM = random.Random(20240617)
POINTS = [
    {name: RANDOM.uniform(-1.4, 1.4) for name in ("x1", "x3")}
    | {"x5": RANDOM.uniform(-3.1, 3.1)}
    | {name: RANDOM.uniform(-5.0, 5.0) for name in ("p", "q", "r")}
    for _ in range(200)
]
eq4, eq13, eq13_inverse = evaluator(eq.EQ4), evaluator(eq.EQ13), evaluator(eq.EQ13_MATRIX.inv())


def angles(point):
    return Vec3(point["x1"], point["x3"], point["x5"])


@pytest.mark.parametrize("column", [0, 1, 2])
def test_eq4_rotation_matrix(column):
    unit = Vec3(*(1.0 if row == column else 0.0 for row in range(3)))
    for point in POINTS:
        expected = eq4(point)[column::3]
        assert rotate(quaternion_from_euler(angles(point)), unit) == pytest.approx(expected, abs=1e-14)


def test_eq4_third_column_is_the_thrust_axis():
    for point in POINTS:
        assert body_z(quaternion_from_euler(angles(point))) == pytest.approx(eq4(point)[2::3], abs=1e-14)


def test_eq13_euler_rates():
    for point in POINTS:
        omega = Vec3(point["p"], point["q"], point["r"])
        assert euler_rates(angles(point), omega) == pytest.approx(eq13(point), rel=1e-12, abs=1e-12)


def test_eq13_inverse():
    for point in POINTS:
        matrix = eq13_inverse(point)
        rates = (point["p"], point["q"], point["r"])
        expected = [sum(a * b for a, b in zip(matrix[3 * i : 3 * i + 3], rates, strict=True)) for i in range(3)]
        assert body_rates(angles(point), Vec3(*rates)) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_table_1_is_the_default_vehicle():
    assert Vehicle()[:10] == (0.56, 9.8, 0.3, 3.5e-3, 3.5e-3, 7.0e-3, 4.2e-3, 3.8e-2, 5.6e-4, 5.6e-4)
