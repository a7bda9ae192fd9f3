"""Polynomials of degree 7 in one coordinate, and the smooth step made of one."""

from typing import NamedTuple


class Septic(NamedTuple):
    """c0 + c1 u + c4 u^4 + ... + c7 u^7 with u = time / duration; starts without acceleration and jerk."""

    c0: float
    c1: float
    c4: float
    c5: float
    c6: float
    c7: float


class Motion(NamedTuple):
    """One coordinate at one instant and its first four derivatives by time."""

    p: float
    v: float
    a: float
    jerk: float
    snap: float


PEAK_RATE = 2.1875
"""Largest slope of the smooth step over unit time: 35/16, at its middle."""

PEAK_ACCELERATION = 7.513188404399293
"""Largest curvature of the smooth step over unit time: 84 sqrt(5) / 25, at 1/2 -+ sqrt(5)/10."""


def septic(p: float, v: float, end: Motion, duration: float) -> Septic:
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


def run_up_length(end: Motion, duration: float) -> float:
    """Return how far ``septic`` from rest should lead so that its u^7 term vanishes.

    The velocity then is the polynomial of least degree (5) that reaches the v, a and jerk of ``end``: it does not
    swing out in order to meet a given length.
    """
    return duration * (end.v / 2.0 + duration * (-end.a / 10.0 + duration * end.jerk / 120.0))


def evaluate(c: Septic, duration: float, time: float) -> Motion:
    """Return the polynomial and its derivatives at ``time`` s of ``duration`` s."""
    u = time / duration
    rate = 1.0 / duration
    rate2 = rate * rate
    return Motion(
        c.c0 + u * (c.c1 + u * u * u * (c.c4 + u * (c.c5 + u * (c.c6 + u * c.c7)))),
        rate * (c.c1 + u * u * u * (4.0 * c.c4 + u * (5.0 * c.c5 + u * (6.0 * c.c6 + u * (7.0 * c.c7))))),
        rate2 * (u * u * (12.0 * c.c4 + u * (20.0 * c.c5 + u * (30.0 * c.c6 + u * (42.0 * c.c7))))),
        rate2 * rate * (u * (24.0 * c.c4 + u * (60.0 * c.c5 + u * (120.0 * c.c6 + u * (210.0 * c.c7))))),
        rate2 * rate2 * (24.0 * c.c4 + u * (120.0 * c.c5 + u * (360.0 * c.c6 + u * (840.0 * c.c7)))),
    )


def smooth_step(low: float, high: float, duration: float, time: float) -> Motion:
    """Return the turn from rest at ``low`` to rest at ``high`` in ``duration`` s (> 0); constant before and after."""
    if time <= 0.0:
        return Motion(low, 0.0, 0.0, 0.0, 0.0)
    if time >= duration:
        return Motion(high, 0.0, 0.0, 0.0, 0.0)
    return evaluate(septic(low, 0.0, Motion(high, 0.0, 0.0, 0.0, 0.0), duration), duration, time)
