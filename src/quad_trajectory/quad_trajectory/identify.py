"""A manoeuvre from whose log a vehicle's parameters can be told: multisines along x, y and z, and in heading.

    a(t) = largest / crest sum_k sin(w_k t + phase_k),    w_k = 2 pi n_k / 20 s

Every axis has whole numbers n_k of its own, so that no axis repeats what another does, and phases that keep its crest
low. The vehicle stays within 1 m of ``centre`` with the accelerations that are set by default.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_core.types import TrajectoryPoint
from quad_trajectory.approach import Approach, Entry, Start, entered
from quad_trajectory.hover import Position
from quad_trajectory.limits import MotionLimits
from quad_trajectory.polynomial import AxisPoint, point

Plan = Approach

BASE = 2.0 * math.pi / 20.0  # rad/s of n = 1


class Wave(NamedTuple):
    """A multisine: n of each line, phase in sixteenths of pi, and its largest value over 20 s (rounded up)."""

    lines: tuple[float, ...]
    phases: tuple[float, ...]
    crest: float


X = Wave((3.0, 7.0, 11.0, 17.0, 23.0, 31.0), (2.0, 18.0, 3.0, 5.0, 22.0, 9.0), 3.11)
Y = Wave((4.0, 9.0, 13.0, 19.0, 25.0, 33.0), (9.0, 28.0, 3.0, 26.0, 0.0, 14.0), 3.84)
Z = Wave((5.0, 10.0, 15.0, 21.0, 28.0, 37.0), (30.0, 28.0, 9.0, 9.0, 9.0, 7.0), 3.92)
TURN = Wave((6.0, 8.0, 12.0, 18.0, 26.0, 35.0), (0.0, 16.0, 0.0, 16.0, 16.0, 16.0), 3.72)
"""Of the rate of turn, which begins at 0."""


class Parameters(NamedTuple):
    """Identify: how it is entered, how long and where it is flown, and how hard."""

    start: Entry = Start.APPROACH.value
    duration: Annotated[float, Real("s", "flight time from t = 0", 0.01, 60.0)] = 55.0
    centre: Position = Position(0.0, 0.0, 2.0)
    yaw: Annotated[float, Real("rad", "heading around which the vehicle turns", -6.3, 6.3)] = 0.0
    horizontal: Annotated[float, Real("m/s^2", "largest acceleration along x, and along y", 0.0, 6.0)] = 2.0
    vertical: Annotated[float, Real("m/s^2", "largest acceleration along z", 0.0, 6.0)] = 2.5
    yaw_rate: Annotated[float, Real("rad/s", "largest rate of turn", 0.0, 3.0)] = 0.8
    limits: MotionLimits = MotionLimits()


def multisine(wave: Wave, centre: float, largest: float, t: float) -> AxisPoint:
    """Return a coordinate around ``centre`` and its derivatives at ``t`` s; the second is at most ``largest``."""
    amplitude = largest / wave.crest
    p, v, a, jerk, snap = centre, 0.0, 0.0, 0.0, 0.0
    for k in range(6):
        w = BASE * wave.lines[k]
        angle = w * t + wave.phases[k] * (math.pi / 16.0)
        sine, cosine = amplitude * math.sin(angle), amplitude * math.cos(angle)
        p -= sine / (w * w)
        v -= cosine / w
        a += sine
        jerk += w * cosine
        snap -= w * w * sine
    return AxisPoint(p, v, a, jerk, snap)


def curve(parameters: Parameters, t: float) -> TrajectoryPoint:
    """Return the point of the manoeuvre at ``t`` s >= 0."""
    centre = parameters.centre
    turn = multisine(TURN, 0.0, parameters.yaw_rate, t)
    return point(
        t,
        multisine(X, centre.x, parameters.horizontal, t),
        multisine(Y, centre.y, parameters.horizontal, t),
        multisine(Z, centre.z, parameters.vertical, t),
        AxisPoint(parameters.yaw + turn.v, turn.a, turn.jerk, turn.snap, 0.0),
    )


plan, duration, sample = entered(curve)
