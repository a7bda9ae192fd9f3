"""Eqs. 61-68 at times computed by hand, derivatives against SymPy, scales, yaw and the end of the flight."""

import math

import pytest
import sympy as sp

from quad_core.parameters import build
from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory import case1, case2, hover, lemniscate

VEHICLE = Vehicle()
AT_REST = VehicleState()
CASES = (case1, case2)
ORDERS = ("p_w", "v_w", "a_w", "jerk_w", "snap_w")


def printed(module, **values):
    parameters = build(module.Parameters, {"start": "printed", "yaw_shaping": "printed", **values})
    return parameters, module.plan(parameters, VEHICLE, AT_REST)


@pytest.mark.parametrize(
    ("t", "position", "velocity", "yaw"),
    [
        (0.0, (5.0, 5.0, 11.0), (0.5, 0.0, 0.0), math.pi / 3),
        (10.0, (10.0, 5.0, 11.0), (0.5, 0.0, 0.0), math.pi / 3),
        (20.0, (15.0, 5.0, 11.0), (0.0, 0.5, 0.0), math.pi / 3),
        (33.0, (15.0, 11.5, 11.0), (0.0, 0.5, 0.0), math.pi / 3),
        (40.0, (15.0, 15.0, 11.0), (-0.5, 0.0, 0.0), 0.0),
        (50.0, (10.0, 15.0, 11.0), (-0.5, 0.0, 0.0), 0.0),
        (60.0, (5.0, 15.0, 11.0), (0.0, -0.5, 0.0), 0.0),
        (79.0, (5.0, 5.5, 11.0), (0.0, -0.5, 0.0), 0.0),
        (80.0, (5.0, 5.0, 11.0), (0.0, 0.0, 0.0), 0.0),
        (95.0, (5.0, 5.0, 11.0), (0.0, 0.0, 0.0), 0.0),
    ],
)
def test_case1_is_eqs_61_to_64(t, position, velocity, yaw):
    point = case1.sample(*printed(case1), t)
    assert point.trajectory_time == t
    assert point.p_w == pytest.approx(position, abs=1e-12)
    assert point.v_w == velocity
    assert point.a_w == point.jerk_w == point.snap_w == (0.0, 0.0, 0.0)
    assert (point.yaw, point.yaw_rate, point.yaw_acceleration) == (yaw, 0.0, 0.0)


def test_case1_corners_meet():
    parameters, plan = printed(case1)
    for corner in (20.0, 40.0, 60.0, 80.0):
        before = case1.sample(parameters, plan, math.nextafter(corner, 0.0))
        assert before.p_w == pytest.approx(case1.sample(parameters, plan, corner).p_w, abs=1e-12)


def test_case2_values_by_hand():
    parameters, plan = printed(case2)
    assert case2.sample(parameters, plan, 0.0).p_w == (10.0, 0.0, 10.0)
    quarter = case2.sample(parameters, plan, math.pi)
    assert quarter.p_w == pytest.approx((0.0, 10.0, 10.0 + math.pi / 2), abs=1e-12)
    assert quarter.v_w == pytest.approx((-5.0, 0.0, 0.5), abs=1e-12)
    assert quarter.a_w == pytest.approx((0.0, -2.5, 0.0), abs=1e-12)
    assert quarter.jerk_w == pytest.approx((1.25, 0.0, 0.0), abs=1e-12)
    assert quarter.snap_w == pytest.approx((0.0, 0.625, 0.0), abs=1e-12)
    assert case2.sample(parameters, plan, 39.99).yaw == math.pi / 3
    assert case2.sample(parameters, plan, 40.0).yaw == 0.0


def test_case2_derivatives_are_exact():
    t = sp.Symbol("t")
    scale, slow = sp.Rational(3, 2), sp.Rational(5, 4)
    position = [scale * p for p in (10 * sp.cos(t / slow / 2), 10 * sp.sin(t / slow / 2), 10 + t / slow / 2)]
    parameters, plan = printed(case2, position_scale=1.5, time_scale=1.25)
    for time in (0.0, 0.7, 3.3, 17.25, 41.5, 79.9):
        point = case2.sample(parameters, plan, time)
        for order, name in enumerate(ORDERS):
            expected = [float(sp.diff(p, t, order).subs(t, sp.Rational(str(time)))) for p in position]
            assert getattr(point, name) == pytest.approx(expected, rel=1e-12, abs=1e-13), name


def test_scales_of_case1():
    parameters, plan = printed(case1, position_scale=0.1, time_scale=0.5)
    point = case1.sample(parameters, plan, 5.0)
    assert point.p_w == pytest.approx((1.0, 0.5, 1.1), abs=1e-12)
    assert point.v_w == pytest.approx((0.1, 0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("module", CASES)
def test_yaw_turns_at_40_s_times_the_time_scale(module):
    parameters, plan = printed(module, time_scale=0.5)
    assert module.sample(parameters, plan, 19.99).yaw == math.pi / 3
    assert module.sample(parameters, plan, 20.0).yaw == 0.0
    shaped, plan = printed(module, time_scale=2.0, duration=100.0, yaw_shaping="smooth")
    assert module.sample(shaped, plan, 80.0).yaw == math.pi / 3
    assert module.sample(shaped, plan, 80.5).yaw < math.pi / 3


@pytest.mark.parametrize("module", CASES)
@pytest.mark.parametrize("limits", [{}, {"limits.yaw_rate": 0.3}, {"limits.yaw_acceleration": 0.2}])
def test_shaped_yaw_turns_within_its_limits_and_is_its_own_derivative(module, limits):
    parameters = build(module.Parameters, {"start": "printed", **limits})
    plan = module.plan(parameters, VEHICLE, AT_REST)
    times = [40.0 + 0.002 * i for i in range(6000)]
    points = [module.sample(parameters, plan, time) for time in times]
    assert points[0].yaw == pytest.approx(math.pi / 3, abs=1e-15)
    assert points[-1].yaw == 0.0
    assert max(abs(p.yaw_rate) for p in points) <= parameters.limits.yaw_rate * (1 + 1e-9)
    assert max(abs(p.yaw_acceleration) for p in points) <= parameters.limits.yaw_acceleration * (1 + 1e-9)
    used = max(
        max(abs(p.yaw_rate) for p in points) / parameters.limits.yaw_rate,
        max(abs(p.yaw_acceleration) for p in points) / parameters.limits.yaw_acceleration,
    )
    assert used > 0.999
    for before, now, after in zip(points, points[1:], points[2:], strict=False):
        assert (after.yaw - before.yaw) / 0.004 == pytest.approx(now.yaw_rate, abs=2e-5)
        assert (after.yaw_rate - before.yaw_rate) / 0.004 == pytest.approx(now.yaw_acceleration, abs=2e-4)


@pytest.mark.parametrize("module", [*CASES, lemniscate])
def test_after_the_end_the_last_point_is_held_at_rest(module):
    parameters = build(module.Parameters, {"start": "printed", "duration": 12.5})
    plan = module.plan(parameters, VEHICLE, AT_REST)
    assert module.duration(parameters, plan) == 12.5
    last = module.sample(parameters, plan, math.nextafter(12.5, 0.0))
    for time in (12.5, 13.0, 1e4):
        point = module.sample(parameters, plan, time)
        assert point.p_w == pytest.approx(last.p_w, abs=1e-9)
        assert point.v_w == point.a_w == point.jerk_w == point.snap_w == Vec3()
        assert point.trajectory_time == time


def test_hover_holds_its_point():
    parameters = build(
        hover.Parameters, {"start": "printed", "position.x": 1.0, "position.y": -2.0, "position.z": 3.5, "yaw": 0.4}
    )
    plan = hover.plan(parameters, VEHICLE, AT_REST)
    rest = Vec3(0.0, 0.0, 0.0)
    expected = TrajectoryPoint(7.0, Vec3(1.0, -2.0, 3.5), rest, rest, rest, rest, 0.4, 0.0, 0.0)
    assert hover.sample(parameters, plan, 7.0) == expected
    assert hover.duration(parameters, plan) == 20.0
