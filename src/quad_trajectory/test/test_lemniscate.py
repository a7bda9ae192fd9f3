"""The lemniscate against its equation by SymPy, its speed and acceleration, and its approach at any speed."""

import math

import pytest
import sympy as sp

from quad_core.parameters import build
from quad_core.types import VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory import lemniscate

VEHICLE = Vehicle()
ORDERS = ("p_w", "v_w", "a_w", "jerk_w", "snap_w")


def norm(v):
    return math.sqrt(sum(c * c for c in v))


def printed(**values):
    parameters = build(lemniscate.Parameters, {"start": "printed", **values})
    return parameters, lemniscate.plan(parameters, VEHICLE, VehicleState())


def test_curve_and_derivatives_are_exact():
    t = sp.Symbol("t")
    speed, width = sp.Rational("7/2"), 4
    theta = speed / (sp.sqrt(2) * width) * t
    position = (1 + width * sp.sin(theta), width * sp.sin(theta) * sp.cos(theta) - 2, sp.Integer(6))
    centre = {"centre.x": 1.0, "centre.y": -2.0, "centre.z": 6.0}
    parameters, plan = printed(speed=3.5, half_width=4.0, yaw=0.3, **centre)
    for time in ("0", "7/10", "33/10", "1725/100", "415/10", "599/10"):
        point = lemniscate.sample(parameters, plan, float(sp.Rational(time)))
        for order, name in enumerate(ORDERS):
            expected = [float(sp.diff(p, t, order).subs(t, sp.Rational(time))) for p in position]
            assert getattr(point, name) == pytest.approx(expected, rel=1e-12, abs=1e-12), name
        assert (point.yaw, point.yaw_rate, point.yaw_acceleration) == (0.3, 0.0, 0.0)


@pytest.mark.parametrize(("speed", "width"), [(3.0, 5.0), (15.0, 10.0)])
def test_largest_speed_and_acceleration(speed, width):
    parameters, plan = printed(speed=speed, half_width=width)
    points = [lemniscate.sample(parameters, plan, i * 0.01) for i in range(4000)]
    assert max(norm(point.v_w) for point in points) == pytest.approx(speed, rel=1e-9)
    assert norm(points[0].v_w) == pytest.approx(speed, rel=1e-12)
    assert max(norm(point.a_w) for point in points) == pytest.approx(17 / 16 * speed**2 / width, rel=1e-4)
