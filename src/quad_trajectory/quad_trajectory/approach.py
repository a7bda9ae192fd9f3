"""The way from where the vehicle is onto a curve, smooth to acceleration and jerk, within stated limits.

Polynomials per axis: a transit that ends at rest, and a run-up from there that meets position, velocity, acceleration
and jerk of the curve's first point. A single polynomial over a long way would multiply the curve's acceleration by the
square of its duration and swing out; this one works from any distance. A plan keeps its limits, or none is returned.
"""

import math
from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_core.geometry import euler_from_quaternion, norm, subtract, wrap_angle
from quad_core.parameters import Choice
from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_trajectory.limits import MotionLimits, allowed_between, is_within, turn_duration
from quad_trajectory.polynomial import AxisPoint, Segment, axes_at, no_segment, point, septic, smooth_step
from quad_trajectory.run_up import plan_run_up

QUANTUM = 0.25
"""s; the approach lasts a multiple of it: exact in binary, and a whole number of steps at the usual rates."""

SHORTEST = 1.0
"""s"""

TRANSIT_TRIES = 1000
"""Durations of the transit that are tried; each is up to 1/64 longer than the one before."""


class Start(IntEnum):
    """How a trajectory is entered: by an approach, or by a step to its first point at take-off, as printed."""

    APPROACH = 0
    PRINTED = 1


Entry = Annotated[
    int, Choice(Start, "approach: a smooth way from where the vehicle is; printed: a step to the curve at take-off")
]
"""The parameter of every trajectory that chooses between them."""


class Approach(NamedTuple):
    """The planned approach: transit, run-up, settling onto the curve, and the yaw turn over all of it.

    ``duration`` in s, 0 for none; yaw in rad.
    """

    duration: float
    transit: Segment
    run_up: Segment
    settle: Segment
    yaw_from: float
    yaw_turn: float


def plan_start(how: int, limits: MotionLimits, gravity: float, start: VehicleState, first: TrajectoryPoint) -> Approach:
    """Return the approach from ``start`` to ``first``; none if ``how`` is PRINTED. Raises as ``plan_approach``."""
    if how == Start.PRINTED:
        return no_approach()
    return plan_approach(limits, gravity, start, first)


def plan_approach(limits: MotionLimits, gravity: float, start: VehicleState, first: TrajectoryPoint) -> Approach:
    """Return the shortest approach (in multiples of QUANTUM) from ``start`` to ``first`` within ``limits``.

    Begins with the position, velocity and yaw of ``start`` without acceleration, ends with p, v, a, jerk and yaw of
    ``first``. The search is a scan over durations with sampled limits, the same on every machine.

    Raises ValueError if no approach keeps the limits.
    """
    allowed = allowed_between(limits, gravity, start, first)
    run_up = plan_run_up(allowed, first)
    run_up_duration = run_up.gain.duration + run_up.settle.duration
    gate = Vec3(run_up.gain.x.c0, run_up.gain.y.c0, run_up.gain.z.c0)
    yaw_from = euler_from_quaternion(start.q_wb).z
    yaw_turn = wrap_angle(first.yaw - yaw_from)
    shortest = turn_duration(limits, yaw_turn)
    transit_time = norm(subtract(gate, start.p_w)) / allowed.speed
    if transit_time + run_up_duration > shortest:
        shortest = transit_time + run_up_duration
    if shortest < SHORTEST:
        shortest = SHORTEST
    quanta = math.floor(shortest / QUANTUM) + 1
    transit = _transit(start, gate, quanta * QUANTUM - run_up_duration)
    tries = 0
    while not is_within(allowed, transit):
        tries += 1
        if tries > TRANSIT_TRIES:
            raise ValueError("no approach within limits: no duration of the transit keeps them")
        quanta += 1 + quanta // 64
        transit = _transit(start, gate, quanta * QUANTUM - run_up_duration)
    return Approach(quanta * QUANTUM, transit, run_up.gain, run_up.settle, yaw_from, yaw_turn)


def no_approach() -> Approach:
    """Return the approach of a ``printed`` start: none, the reference steps to the curve at once."""
    return Approach(0.0, no_segment(), no_segment(), no_segment(), 0.0, 0.0)


def sample_approach(approach: Approach, time: float) -> TrajectoryPoint:
    """Return the reference at ``time`` s after take-off, 0 <= time < duration of the approach."""
    since_gate = time - approach.transit.duration
    if time < approach.transit.duration:
        x, y, z = axes_at(approach.transit, time)
    elif approach.settle.duration == 0.0 or since_gate < approach.run_up.duration:
        x, y, z = axes_at(approach.run_up, since_gate)
    else:
        x, y, z = axes_at(approach.settle, since_gate - approach.run_up.duration)
    yaw = smooth_step(approach.yaw_from, approach.yaw_from + approach.yaw_turn, approach.duration, time)
    return point(time - approach.duration, x, y, z, yaw)


def _transit(start: VehicleState, gate: Vec3, duration: float) -> Segment:
    return Segment(
        duration,
        septic(start.p_w.x, start.v_w.x, AxisPoint(gate.x, 0.0, 0.0, 0.0, 0.0), duration),
        septic(start.p_w.y, start.v_w.y, AxisPoint(gate.y, 0.0, 0.0, 0.0, 0.0), duration),
        septic(start.p_w.z, start.v_w.z, AxisPoint(gate.z, 0.0, 0.0, 0.0, 0.0), duration),
    )
