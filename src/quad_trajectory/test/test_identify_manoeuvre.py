"""The manoeuvre of identification against its equation by SymPy, and within its bounds."""

import math

import pytest
import sympy as sp

from quad_core.parameters import build
from quad_trajectory import identify

ORDERS = ("p_w", "v_w", "a_w", "jerk_w", "snap_w")


def test_curve_and_derivatives_are_exact():
    t = sp.Symbol("t")
    parameters = build(identify.Parameters, {"yaw": 0.3})
    axes = []
    for wave, largest in zip(
        (identify.X, identify.Y, identify.Z, identify.TURN), (2, 2, sp.Rational(5, 2), sp.Rational(4, 5)), strict=True
    ):
        lines = zip(wave.lines, wave.phases, strict=True)
        second = sum(sp.sin(sp.pi * int(n) / 10 * t + sp.pi * int(phase) / 16) for n, phase in lines)
        axes.append(largest / sp.Rational(str(wave.crest)) * second)
    for time in (0, sp.Rational(33, 10), 50):
        point = identify.curve(parameters, float(time))
        for order, name in enumerate(ORDERS[2:]):
            expected = [float(sp.diff(a, t, order).subs(t, time)) for a in axes[:3]]
            assert getattr(point, name) == pytest.approx(expected, rel=1e-9, abs=1e-9)
        rate, acceleration = (float(sp.diff(axes[3], t, order).subs(t, time)) for order in (0, 1))
        assert (point.yaw_rate, point.yaw_acceleration) == pytest.approx((rate, acceleration), abs=1e-9)


def test_position_and_velocity_are_the_integrals():
    parameters, h = build(identify.Parameters, {}), 1e-4
    for time in (0.0, 7.7, 41.3):
        before, here, after = (identify.curve(parameters, time + shift) for shift in (-h, 0.0, h))
        for name, order in (("p_w", "v_w"), ("v_w", "a_w")):
            slope = [(b - a) / (2.0 * h) for a, b in zip(getattr(before, name), getattr(after, name), strict=True)]
            assert slope == pytest.approx(list(getattr(here, order)), abs=1e-5)
        assert (after.yaw - before.yaw) / (2.0 * h) == pytest.approx(here.yaw_rate, abs=1e-5)


def test_the_manoeuvre_keeps_its_bounds_and_begins_without_a_rate_of_turn():
    parameters = build(identify.Parameters, {})
    points = [identify.curve(parameters, 0.01 * step) for step in range(5500)]
    for axis, largest in enumerate((2.0, 2.0, 2.5)):
        assert 0.95 * largest < max(abs(point.a_w[axis]) for point in points) <= largest
        assert max(abs(point.p_w[axis] - parameters.centre[axis]) for point in points) < 1.0
    assert 0.95 * 0.8 < max(abs(point.yaw_rate) for point in points) <= 0.8
    assert max(abs(point.yaw) for point in points) < math.radians(60.0)
    assert points[0].yaw_rate == pytest.approx(0.0, abs=1e-12)
