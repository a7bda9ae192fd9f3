"""Polynomials of degree 7 in one coordinate, which every planned motion is made of, and points put together of them.

p(u) = c0 + c1 u + ... + c7 u^7,    u = time / duration

Planning calls them in plain Python, on floats or on arrays of them (many instants, many segments); what samples a plan
at each step calls them on floats and is compiled.
"""

from typing import NamedTuple

from quad_core.geometry import ZERO
from quad_core.types import TrajectoryPoint, Vec3


class Polynomial(NamedTuple):
    """Coefficients of p(u), all in the unit of the coordinate."""

    c0: float
    c1: float
    c2: float
    c3: float
    c4: float
    c5: float
    c6: float
    c7: float


class AxisPoint(NamedTuple):
    """One coordinate (m or rad) at one instant and its first four derivatives by time in s."""

    p: float
    v: float
    a: float
    jerk: float
    snap: float


PEAK_RATE = 2.1875  # largest slope of the smooth step over unit time: 35/16, at its middle

PEAK_ACCELERATION = 7.513188404399293
"""Largest curvature of the smooth step over unit time: 84 sqrt(5) / 25, at 1/2 -+ sqrt(5)/10."""


def septic(start: AxisPoint, end: AxisPoint, duration: float) -> Polynomial:
    """Return the polynomial from the p, v, a and jerk of ``start`` to those of ``end``.

    ``duration`` in s, > 0. No snap is met.
    """
    c1, c2 = start.v * duration, 0.5 * (start.a * duration * duration)
    c3 = start.jerk * duration * duration * duration / 6.0
    rise = end.p - start.p - c1 - c2 - c3
    speed = (end.v - start.v) * duration - 2.0 * c2 - 3.0 * c3
    acceleration = end.a * duration * duration - 2.0 * c2 - 6.0 * c3
    jerk = end.jerk * duration * duration * duration - 6.0 * c3
    return Polynomial(
        start.p,
        c1,
        c2,
        c3,
        35.0 * rise - 15.0 * speed + 2.5 * acceleration - jerk / 6.0,
        -84.0 * rise + 39.0 * speed - 7.0 * acceleration + 0.5 * jerk,
        70.0 * rise - 34.0 * speed + 6.5 * acceleration - 0.5 * jerk,
        -20.0 * rise + 10.0 * speed - 2.0 * acceleration + jerk / 6.0,
    )


def constant_jerk(start: AxisPoint, jerk: float) -> Polynomial:
    """Return the polynomial of duration 1 s from p, v and a of ``start`` on under ``jerk``; it holds for longer."""
    return Polynomial(start.p, start.v, 0.5 * start.a, jerk / 6.0, 0.0, 0.0, 0.0, 0.0)


def settling(end: AxisPoint, duration: float) -> Polynomial:
    """Return the polynomial from a steady velocity to the p, v, a and jerk of ``end`` in ``duration`` s, > 0.

    Its acceleration is the cubic from (0, 0) to (a, jerk) of ``end``; the steady velocity before it follows from that.
    """
    jerk = duration * end.jerk
    quartic = duration * duration * (end.a / 4.0 - jerk / 12.0)
    quintic = duration * duration * (jerk / 20.0 - end.a / 10.0)
    steady = duration * (end.v - duration * (end.a / 2.0 - jerk / 12.0))
    return Polynomial(end.p - steady - quartic - quintic, steady, 0.0, 0.0, quartic, quintic, 0.0, 0.0)


def run_up_length(end: AxisPoint, duration: float) -> float:
    """Return how far ``septic`` from rest should lead so that its u^7 term vanishes.

    The velocity then is the polynomial of least degree (5) that reaches the v, a and jerk of ``end``: it does not
    swing out in order to meet a given length.
    """
    return duration * (end.v / 2.0 + duration * (-end.a / 10.0 + duration * end.jerk / 120.0))


def evaluate(c: Polynomial, duration: float, time: float) -> AxisPoint:
    """Return the polynomial and its derivatives at ``time`` s of ``duration`` s."""
    u = time / duration
    rate = 1.0 / duration
    rate2 = rate * rate
    cube = u * u * u
    # c2 and c3 are taken off as 0 - c: where they are 0, as in every approach, not even the sign of a zero changes
    less_p, less_v = 0.0 - u * (c.c2 + u * c.c3), 0.0 - u * (2.0 * c.c2 + u * (3.0 * c.c3))
    less_a, less_jerk = 0.0 - 2.0 * c.c2 - u * (6.0 * c.c3), 0.0 - 6.0 * c.c3
    return AxisPoint(
        c.c0 + u * (c.c1 + (cube * (c.c4 + u * (c.c5 + u * (c.c6 + u * c.c7))) - less_p)),
        rate * (c.c1 + (cube * (4.0 * c.c4 + u * (5.0 * c.c5 + u * (6.0 * c.c6 + u * (7.0 * c.c7)))) - less_v)),
        rate2 * (u * u * (12.0 * c.c4 + u * (20.0 * c.c5 + u * (30.0 * c.c6 + u * (42.0 * c.c7)))) - less_a),
        rate2 * rate * (u * (24.0 * c.c4 + u * (60.0 * c.c5 + u * (120.0 * c.c6 + u * (210.0 * c.c7)))) - less_jerk),
        rate2 * rate2 * (24.0 * c.c4 + u * (120.0 * c.c5 + u * (360.0 * c.c6 + u * (840.0 * c.c7)))),
    )


def smooth_step(first: float, last: float, duration: float, time: float) -> AxisPoint:
    """Return the step from rest at ``first`` to rest at ``last`` in ``duration`` s (> 0); constant before and after."""
    if time <= 0.0:
        return resting(first)
    if time >= duration:
        return resting(last)
    return evaluate(septic(resting(first), resting(last), duration), duration, time)


class Segment(NamedTuple):
    """One polynomial per world axis over a common duration in s; duration 0: there is no such segment."""

    duration: float
    x: Polynomial
    y: Polynomial
    z: Polynomial


def no_segment(p: Vec3) -> Segment:
    """Return a segment of duration 0 at ``p``."""
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Segment(0.0, Polynomial(p.x, *zero), Polynomial(p.y, *zero), Polynomial(p.z, *zero))


def resting(p: float) -> AxisPoint:
    """Return one coordinate at rest at ``p``."""
    return AxisPoint(p, 0.0, 0.0, 0.0, 0.0)


def coordinates(point: TrajectoryPoint) -> tuple[AxisPoint, AxisPoint, AxisPoint]:
    """Return x, y and z of a reference without their snap."""
    p, v, a, j = point.p_w, point.v_w, point.a_w, point.jerk_w
    return AxisPoint(p.x, v.x, a.x, j.x, 0.0), AxisPoint(p.y, v.y, a.y, j.y, 0.0), AxisPoint(p.z, v.z, a.z, j.z, 0.0)


def axes_at(segment: Segment, time: float) -> tuple[AxisPoint, AxisPoint, AxisPoint]:
    """Return x, y and z at ``time`` s since the start of a segment of some duration."""
    return (
        evaluate(segment.x, segment.duration, time),
        evaluate(segment.y, segment.duration, time),
        evaluate(segment.z, segment.duration, time),
    )


def point(time: float, x: AxisPoint, y: AxisPoint, z: AxisPoint, yaw: AxisPoint) -> TrajectoryPoint:
    """Return the reference with these coordinates; ``time`` in s is t of eqs. 61-68."""
    return TrajectoryPoint(
        time,
        Vec3(x.p, y.p, z.p),
        Vec3(x.v, y.v, z.v),
        Vec3(x.a, y.a, z.a),
        Vec3(x.jerk, y.jerk, z.jerk),
        Vec3(x.snap, y.snap, z.snap),
        yaw.p,
        yaw.v,
        yaw.a,
    )


def at_rest(last: TrajectoryPoint, time: float) -> TrajectoryPoint:
    """Return ``last`` at rest: the reference once the trajectory is over. ``time`` in s is t of eqs. 61-68."""
    return TrajectoryPoint(time, last.p_w, ZERO, ZERO, ZERO, ZERO, last.yaw, 0.0, 0.0)
