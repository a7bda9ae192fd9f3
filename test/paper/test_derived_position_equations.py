"""Steps of the proof of the position law, held against the law's own functions: eqs. 19, 20, 22, 24, 26-28, 31, 32.

Derivatives are taken of what the functions return, by central differences along a motion that the point gives.
"""

import random

import paper_equations as eq
import pytest
from evaluation import evaluator
from paper_points import INDICES, position_points

from quad_position_ctrl import backstepping as law

pytestmark = pytest.mark.unit

STEP = 1e-4
CHANCE = random.Random(2036)
CLOSE = {"rel": 1e-6, "abs": 1e-6}
SAME = {"rel": 1e-12, "abs": 1e-12}
POINTS = [
    point | {f"x{second}_dot": CHANCE.uniform(-4.0, 4.0) for _, second in INDICES} | {"xi8": CHANCE.uniform(1.0, 9.0)}
    for point in position_points(count=30, seed=1936)
]
VELOCITIES = {x.diff(eq.t): v for x, v in ((eq.x7, eq.x8), (eq.x9, eq.x10), (eq.x11, eq.x12))}


def along_motion(expression):
    """Return an evaluator in which x_7' is x_8 and Gamma_7' is e_7."""
    return evaluator(expression.xreplace(VELOCITIES).xreplace(eq.EQ21).xreplace(VELOCITIES))


eq19, eq20, eq24, eq26 = (evaluator(rows) for rows in (eq.EQ19, eq.EQ20, eq.EQ24, eq.EQ26))
eq22, eq27, eq28 = (along_motion(rows) for rows in (eq.EQ22, eq.EQ27, eq.EQ28))
eq31, eq32 = evaluator(eq.EQ31), evaluator(eq.EQ32)


@pytest.fixture(params=[0, 1, 2], ids=["x", "y", "z"])
def axis(request):
    return request.param


def moved(point, axis, time):
    """Return the point ``time`` s later: position and reference by their rates, Gamma by the law's own integrator."""
    first, second = INDICES[axis]
    error = law.tracking_error(point[f"x{first}"], point[f"x{first}d"])
    return point | {
        f"x{first}": point[f"x{first}"] + time * point[f"x{second}"],
        f"x{second}": point[f"x{second}"] + time * point[f"x{second}_dot"],
        f"x{first}d": point[f"x{first}d"] + time * point[f"x{first}d_dot"],
        f"x{first}d_dot": point[f"x{first}d_dot"] + time * point[f"x{first}d_ddot"],
        f"Gamma{first}": law.next_integral(point[f"Gamma{first}"], error, 1e9, time),
    }


def slope(function, point, axis):
    return (function(moved(point, axis, STEP), axis) - function(moved(point, axis, -STEP), axis)) / (2.0 * STEP)


def first_error(point, axis):
    first, _ = INDICES[axis]
    return law.tracking_error(point[f"x{first}"], point[f"x{first}d"])


def virtual(point, axis):
    first, _ = INDICES[axis]
    gains = point[f"xi{first}"], point[f"k{first}"]
    correction = law.correction_velocity(*gains, first_error(point, axis), point[f"Gamma{first}"])
    return law.virtual_velocity(correction, point[f"x{first}d_dot"])


def second_error(point, axis):
    return law.tracking_error(point[f"x{INDICES[axis][1]}"], virtual(point, axis))


def first_function(point, axis):
    first, _ = INDICES[axis]
    return law.lyapunov(point[f"k{first}"], first_error(point, axis), 0.0, point[f"Gamma{first}"])


def second_function(point, axis):
    first, _ = INDICES[axis]
    return law.lyapunov(point[f"k{first}"], first_error(point, axis), second_error(point, axis), point[f"Gamma{first}"])


def test_eq19_is_the_rate_of_the_first_error(axis):
    for point in POINTS:
        assert slope(first_error, point, axis) == pytest.approx(eq19(point)[axis], **CLOSE)


def test_eq20_first_function(axis):
    for point in POINTS:
        assert first_function(point, axis) == pytest.approx(eq20(point)[axis], **SAME)


def test_eq22_is_the_rate_of_the_first_function(axis):
    for point in POINTS:
        assert slope(first_function, point, axis) == pytest.approx(eq22(point)[axis], **CLOSE)


def test_eq24_holds_at_the_virtual_velocity(axis):
    first, second = INDICES[axis]
    for point in POINTS:
        there = point | {f"x{second}": virtual(point, axis)}
        assert slope(first_function, there, axis) == pytest.approx(eq24(there)[axis], **CLOSE)
        rate = law.lyapunov_rate(point[f"xi{first}"], 5.0, first_error(point, axis), 0.0)
        assert rate == pytest.approx(eq24(point)[axis], **SAME)
        assert rate <= 0.0


def test_eq26_second_function(axis):
    for point in POINTS:
        assert second_function(point, axis) == pytest.approx(eq26(point)[axis], **SAME)


def test_eqs_27_and_28_are_the_rate_of_the_second_function(axis):
    for point in POINTS:
        rate = slope(second_function, point, axis)
        assert rate == pytest.approx(eq27(point)[axis], **CLOSE)
        assert rate == pytest.approx(eq28(point)[axis], **CLOSE)


def test_eq31_is_the_second_function_and_the_estimation_error():
    for point in POINTS:
        estimation = 0.5 * (point["xi8"] - point["xi8_hat"]) ** 2 / point["alpha8"]
        assert second_function(point, 0) + estimation == pytest.approx(eq31(point)[0], **SAME)


def test_eq32_loses_its_third_term_by_the_adaptive_rate():
    for point in POINTS:
        rate = law.adaptive_rate(point["alpha8"], second_error(point, 0))
        found = eq32(point | {"xi8_hat_dot": rate})[0]
        expected = law.lyapunov_rate(point["xi7"], point["xi8"], first_error(point, 0), second_error(point, 0))
        assert found == pytest.approx(expected, **SAME)
