"""Polynomials of degree 7 in one coordinate, the smooth step made of one, and points put together of coordinates.

p(u) = c0 + c1 u + c4 u^4 + c5 u^5 + c6 u^6 + c7 u^7,    u = time / duration
"""

from typing import NamedTuple

from quad_core.geometry import ZERO
from quad_core.types import TrajectoryPoint, Vec3


class Septic(NamedTuple):
    """Coefficients of p(u), all in the unit of the coordinate; p starts without acceleration and jerk."""

    c0: float
    c1: float
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


PEAK_RATE = 2.1875
"""Largest slope of the smooth step over unit time: 35/16, at its middle."""

PEAK_ACCELERATION = 7.513188404399293
"""Largest curvature of the smooth step over unit time: 84 sqrt(5) / 25, at 1/2 -+ sqrt(5)/10."""


def septic(p: float, v: float, end: AxisPoint, duration: float) -> Septic:
    """Return the polynomial from (p, v, a = 0, jerk = 0) to the p, v, a and jerk of ``end``.

    ``duration`` in s, > 0. The snap of ``end`` is not met.
    """
    rise = end.p - p - v * duration
    speed = (end.v - v) * duration
    acceleration = end.a * duration * duration
    jerk = end.jerk * duration * duration * duration
    return Septic(
        p,
        v * duration,
        35.0 * rise - 15.0 * speed + 2.5 * acceleration - jerk / 6.0,
        -84.0 * rise + 39.0 * speed - 7.0 * acceleration + 0.5 * jerk,
        70.0 * rise - 34.0 * speed + 6.5 * acceleration - 0.5 * jerk,
        -20.0 * rise + 10.0 * speed - 2.0 * acceleration + jerk / 6.0,
    )


def settling(end: AxisPoint, duration: float) -> Septic:
    """Return the polynomial from a steady velocity to the p, v, a and jerk of ``end`` in ``duration`` s, > 0.

    Its acceleration is the cubic from (0, 0) to (a, jerk) of ``end``; the steady velocity before it follows from that.
    """
    jerk = duration * end.jerk
    quartic = duration * duration * (end.a / 4.0 - jerk / 12.0)
    quintic = duration * duration * (jerk / 20.0 - end.a / 10.0)
    steady = duration * (end.v - duration * (end.a / 2.0 - jerk / 12.0))
    return Septic(end.p - steady - quartic - quintic, steady, quartic, quintic, 0.0, 0.0)


def run_up_length(end: AxisPoint, duration: float) -> float:
    """Return how far ``septic`` from rest should lead so that its u^7 term vanishes.

    The velocity then is the polynomial of least degree (5) that reaches the v, a and jerk of ``end``: it does not
    swing out in order to meet a given length.
    """
    return duration * (end.v / 2.0 + duration * (-end.a / 10.0 + duration * end.jerk / 120.0))


def evaluate(c: Septic, duration: float, time: float) -> AxisPoint:
    """Return the polynomial and its derivatives at ``time`` s of ``duration`` s."""
    u = time / duration
    rate = 1.0 / duration
    rate2 = rate * rate
    return AxisPoint(
        c.c0 + u * (c.c1 + u * u * u * (c.c4 + u * (c.c5 + u * (c.c6 + u * c.c7)))),
        rate * (c.c1 + u * u * u * (4.0 * c.c4 + u * (5.0 * c.c5 + u * (6.0 * c.c6 + u * (7.0 * c.c7))))),
        rate2 * (u * u * (12.0 * c.c4 + u * (20.0 * c.c5 + u * (30.0 * c.c6 + u * (42.0 * c.c7))))),
        rate2 * rate * (u * (24.0 * c.c4 + u * (60.0 * c.c5 + u * (120.0 * c.c6 + u * (210.0 * c.c7))))),
        rate2 * rate2 * (24.0 * c.c4 + u * (120.0 * c.c5 + u * (360.0 * c.c6 + u * (840.0 * c.c7)))),
    )


def smooth_step(first: float, last: float, duration: float, time: float) -> AxisPoint:
    """Return the step from rest at ``first`` to rest at ``last`` in ``duration`` s (> 0); constant before and after."""
    if time <= 0.0:
        return AxisPoint(first, 0.0, 0.0, 0.0, 0.0)
    if time >= duration:
        return AxisPoint(last, 0.0, 0.0, 0.0, 0.0)
    return evaluate(septic(first, 0.0, AxisPoint(last, 0.0, 0.0, 0.0, 0.0), duration), duration, time)


class Segment(NamedTuple):
    """One polynomial per world axis over a common duration in s; duration 0: there is no such segment."""

    duration: float
    x: Septic
    y: Septic
    z: Septic


def no_segment(p: Vec3) -> Segment:
    """Return a segment of duration 0 at ``p``."""
    return Segment(0.0, resting(p.x), resting(p.y), resting(p.z))


def resting(p: float) -> Septic:
    """Return the polynomial that stays at ``p``."""
    return Septic(p, 0.0, 0.0, 0.0, 0.0, 0.0)


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
