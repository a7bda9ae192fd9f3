"""The run-up: from rest onto the curve with its velocity, acceleration and jerk, within limits.

One polynomial where one will do: the velocity of degree 5 that meets v, a and jerk of the curve's first point. A curve
with much jerk for its acceleration makes that polynomial swing out; then there are two: from rest to a steady
velocity, and from there onto the curve, in a time that has nothing to do with how long gaining speed takes.
"""

import math
from typing import NamedTuple

import numpy as np

from quad_core.geometry import ZERO, norm
from quad_core.types import TrajectoryPoint, Vec3
from quad_trajectory.limits import Allowed, first_within, horizontal
from quad_trajectory.polynomial import Segment, coordinates, no_segment, resting, run_up_length, septic, settling

GROWTH = 1.02
TRIES = 300

SETTLE_FIRST = 1.0
SETTLE_SHRINK = 0.9
SETTLE_GROWTH = 1.1
SETTLE_TRIES = 50
"""Times in s tried for settling onto the curve: from SETTLE_FIRST down to 1/200 of it, then up to 100 times it."""

SHORTEST_GAIN = 0.01
"""s"""

STEP_PEAK_ACCELERATION = 1.875
STEP_PEAK_JERK = 5.773502691896258
"""Of the velocity step 10 u^3 - 15 u^4 + 6 u^5: 15/8 at u = 1/2, 10/sqrt(3) at u = (1 - 1/sqrt(3)) / 2."""

NO_MOTION = 1e-9


class RunUp(NamedTuple):
    """From rest to a velocity (``gain``), then onto the curve (``settle``, duration 0 where ``gain`` leads there)."""

    gain: Segment
    settle: Segment


REFUSAL = (
    "no approach within limits.speed, acceleration, jerk and tilt: from steady flight the acceleration and "
    "jerk of the curve's first point are not reached within them; raise the limits or slow the curve down"
)


def plan_run_up(allowed: Allowed, first: TrajectoryPoint) -> RunUp:
    """Return how ``first`` is reached from rest; raises ValueError if nothing within ``allowed`` does."""
    speed, steady = norm(first.v_w), norm(first.a_w) < NO_MOTION and norm(first.jerk_w) < NO_MOTION
    if speed < NO_MOTION and steady:
        return RunUp(no_segment(first.p_w), no_segment(ZERO))
    if speed >= NO_MOTION:
        horizontal_acceleration = allowed.tilt_tangent * (allowed.gravity + allowed.acceleration)
        by_tilt = horizontal(first.v_w.x, first.v_w.y) / horizontal_acceleration
        one = _gain_within(allowed, first, max(by_tilt, speed / allowed.acceleration))
        if one is not None:
            return RunUp(one, no_segment(ZERO))
    settle = no_segment(ZERO) if steady else _settle_within(allowed, first)
    gate = first if steady else _steady_before(first, settle)
    gain = _gain_within(allowed, gate, _steady_gain_time(allowed, norm(gate.v_w)))
    if gain is None:
        raise ValueError(REFUSAL)
    return RunUp(gain, settle)


def _gain_within(allowed: Allowed, end: TrajectoryPoint, shortest: float) -> Segment | None:
    """Return the first within limits of the polynomials from rest to ``end`` in ``shortest`` s and more, or none.

    Each begins where it has the least degree.
    """
    durations = np.multiply.accumulate([shortest, *TRIES * (GROWTH,)])
    return first_within(
        allowed,
        durations,
        lambda duration: tuple(
            septic(resting(axis.p - run_up_length(axis, duration)), axis, duration) for axis in coordinates(end)
        ),
    )


def _settle_within(allowed: Allowed, first: TrajectoryPoint) -> Segment:
    """Return how ``first`` is settled onto from a steady velocity; as smoothly as SETTLE_FIRST allows."""
    shorter = np.multiply.accumulate([SETTLE_FIRST, *SETTLE_TRIES * (SETTLE_SHRINK,)])
    longer = np.multiply.accumulate([SETTLE_FIRST, *SETTLE_TRIES * (SETTLE_GROWTH,)])
    settle = first_within(
        allowed,
        np.concatenate([shorter, longer[1:]]),
        lambda duration: tuple(settling(axis, duration) for axis in coordinates(first)),
    )
    if settle is None:
        raise ValueError(REFUSAL)
    return settle


def _steady_before(first: TrajectoryPoint, settle: Segment) -> TrajectoryPoint:
    """Return the steady flight with which ``settle`` begins."""
    rate = 1.0 / settle.duration
    velocity = Vec3(rate * settle.x.c1, rate * settle.y.c1, rate * settle.z.c1)
    gate = Vec3(settle.x.c0, settle.y.c0, settle.z.c0)
    return TrajectoryPoint(first.trajectory_time, gate, velocity, ZERO, ZERO, ZERO, first.yaw, 0.0, 0.0)


def _steady_gain_time(allowed: Allowed, speed: float) -> float:
    """Return the shortest time in s from rest to a steady ``speed`` within the limits of acceleration and jerk."""
    by_acceleration = STEP_PEAK_ACCELERATION * speed / allowed.acceleration
    return max(math.sqrt(STEP_PEAK_JERK * speed / allowed.jerk), by_acceleration, SHORTEST_GAIN)
