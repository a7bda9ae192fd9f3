"""The way from where the vehicle is onto a curve, smooth to acceleration and jerk, within stated limits.

From the ground first LIFT m straight up, from rest to rest, so that the vehicle is clear of it before it tilts. Then
polynomials per axis: a transit that ends at rest, and a run-up from there that meets position, velocity, acceleration
and jerk of the curve's first point. A single polynomial over a long way would multiply the curve's acceleration by the
square of its duration and swing out; this one works from any distance. A plan keeps its limits, or none is returned.

The run-up is one polynomial where one will do: the velocity of degree 5 that meets v, a and jerk of the first point. A
curve with much jerk for its acceleration makes it swing out; then there are two: from rest to a steady velocity, and
from there onto the curve, in a time that has nothing to do with how long gaining speed takes.
"""

import math
from collections.abc import Callable
from enum import IntEnum
from typing import Annotated, Any, NamedTuple

import numpy as np

from quad_core.geometry import ZERO, euler_from_quaternion, norm, subtract, wrap_angle
from quad_core.parameters import Choice
from quad_core.types import TrajectoryPoint, Vec3, VehicleState, fresh
from quad_core.vehicle import Vehicle
from quad_trajectory.limits import Allowed, MotionLimits, allowed_between, first_within, horizontal, turn_duration
from quad_trajectory.polynomial import (
    AxisPoint,
    Segment,
    at_rest,
    axes_at,
    coordinates,
    no_segment,
    point,
    resting,
    run_up_length,
    septic,
    settling,
    smooth_step,
)

GAIN_GROWTH = 1.02
GAIN_TRIES = 300

SETTLE_FIRST = 1.0
SETTLE_SHRINK = 0.9
SETTLE_GROWTH = 1.1
SETTLE_TRIES = 50
"""Times in s tried for settling onto the curve: from SETTLE_FIRST down to 1/200 of it, then up to 100 times it."""

SHORTEST_GAIN = 0.01  # s

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
    durations = np.multiply.accumulate([shortest, *GAIN_TRIES * (GAIN_GROWTH,)])
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


QUANTUM = 0.25
"""s; the approach lasts a multiple of it: exact in binary, and a whole number of steps at the usual rates."""

SHORTEST = 1.0  # s

TRIES = 1000  # durations of lift-off and transit that are tried; each is up to 1/64 longer than the one before

LIFT = 1.5  # m straight up from the ground: twice what ``quad_core.lift_off`` takes for clear of it

AT_REST = 0.15  # m/s that the estimate of a vehicle standing on the ground may show


class Start(IntEnum):
    """How a trajectory is entered: by an approach, or by a step to its first point at take-off, as printed."""

    APPROACH = 0
    PRINTED = 1


Entry = Annotated[
    int, Choice(Start, "approach: a smooth path from the vehicle to the curve; printed: a step to the curve")
]
"""The parameter of every trajectory that chooses between them."""


class Approach(NamedTuple):
    """The planned approach: lift-off, transit, run-up, settling onto the curve, and the yaw turn from the transit on.

    ``duration`` in s, 0 for none; yaw in rad.
    """

    duration: float
    lift: Segment
    transit: Segment
    run_up: Segment
    settle: Segment
    yaw_from: float
    yaw_turn: float


def plan_approach(
    how: int, limits: MotionLimits, gravity: float, start: VehicleState, first: TrajectoryPoint
) -> Approach:
    """Return the shortest approach (in multiples of QUANTUM) from ``start`` to ``first`` within ``limits``.

    Begins with the position, velocity and yaw of ``start`` without acceleration, on the ground at rest; ends with p, v,
    a, jerk and yaw of ``first``. The search is a scan over durations with sampled limits, the same on every machine.
    None if ``how`` is PRINTED: the reference steps to the curve at once.

    Raises ValueError if no approach keeps the limits, or where the estimate moves on the ground.
    """
    lift = no_segment(ZERO)
    if start.on_ground and norm(start.v_w) > AT_REST:
        raise ValueError("the estimate moves faster than 0.15 m/s while the vehicle stands on the ground")
    if how == Start.PRINTED:
        return Approach(0.0, lift, lift, lift, lift, 0.0, 0.0)
    if start.on_ground:
        p = start.p_w
        above = Vec3(p.x, p.y, p.z + LIFT)
        upwards = Allowed(limits.speed, limits.acceleration, limits.jerk, math.tan(limits.tilt), gravity)
        lift = quickest_way(upwards, p, ZERO, above, LIFT / limits.speed, 0.0)
        start = fresh(above, ZERO, start.q_wb, ZERO)
    allowed = allowed_between(limits, gravity, start, first)
    run_up = plan_run_up(allowed, first)
    run_up_duration = run_up.gain.duration + run_up.settle.duration
    gate = Vec3(run_up.gain.x.c0, run_up.gain.y.c0, run_up.gain.z.c0)
    yaw_from = euler_from_quaternion(start.q_wb).z
    yaw_turn = wrap_angle(first.yaw - yaw_from)
    shortest = turn_duration(limits, yaw_turn)
    transit_time = norm(subtract(gate, start.p_w)) / allowed.speed
    shortest = max(shortest, transit_time + run_up_duration, SHORTEST)
    transit = quickest_way(allowed, start.p_w, start.v_w, gate, shortest, run_up_duration)
    duration = QUANTUM * round((transit.duration + run_up_duration) / QUANTUM)
    return Approach(lift.duration + duration, lift, transit, run_up.gain, run_up.settle, yaw_from, yaw_turn)


def quickest_way(allowed: Allowed, p: Vec3, v: Vec3, gate: Vec3, shortest: float, reserved: float) -> Segment:
    """Return the quickest way within ``allowed`` from ``p``, ``v`` to rest at ``gate``.

    With the ``reserved`` s of what follows it lasts a multiple of QUANTUM, longer than ``shortest`` s.
    """
    quanta = [math.floor(shortest / QUANTUM) + 1]
    for _ in range(TRIES - 1):
        quanta.append(quanta[-1] + 1 + quanta[-1] // 64)
    starts = [AxisPoint(*axis, 0.0, 0.0, 0.0) for axis in zip(p, v, strict=True)]
    way = first_within(
        allowed,
        np.array(quanta) * QUANTUM - reserved,
        lambda duration: tuple(septic(start, resting(end), duration) for start, end in zip(starts, gate, strict=True)),
    )
    if way is None:
        raise ValueError("no approach within limits: no duration of lift-off or transit keeps them")
    return way


def sample_approach(approach: Approach, time: float) -> TrajectoryPoint:
    """Return the reference at ``time`` s after take-off, 0 <= time < duration of the approach."""
    since_lift = time - approach.lift.duration
    since_gate = since_lift - approach.transit.duration
    if since_lift < 0.0:
        x, y, z = axes_at(approach.lift, time)
        since_lift = 0.0
    elif since_gate < 0.0:
        x, y, z = axes_at(approach.transit, since_lift)
    elif approach.settle.duration == 0.0 or since_gate < approach.run_up.duration:
        x, y, z = axes_at(approach.run_up, since_gate)
    else:
        x, y, z = axes_at(approach.settle, since_gate - approach.run_up.duration)
    turning = approach.duration - approach.lift.duration
    yaw = smooth_step(approach.yaw_from, approach.yaw_from + approach.yaw_turn, turning, since_lift)
    return point(time - approach.duration, x, y, z, yaw)


def entered(curve: Callable[[Any, float], TrajectoryPoint]) -> tuple[Callable[..., Any], ...]:
    """Return ``plan``, ``duration`` and ``sample`` of the trajectory ``curve(parameters, t)``, entered by an approach.

    Its parameters have ``start``, ``limits`` and ``duration``. From its end on the vehicle rests on the last point.
    """

    def plan(parameters: Any, vehicle: Vehicle, start: VehicleState) -> Approach:
        """Return how the curve is reached from ``start``; raises ValueError if no approach keeps the limits."""
        return plan_approach(parameters.start, parameters.limits, vehicle.gravity, start, curve(parameters, 0.0))

    def duration(parameters: Any, plan: Approach) -> float:
        """Return the end of the flight in s since take-off."""
        length: float = plan.duration + parameters.duration
        return length

    def sample(parameters: Any, plan: Approach, time: float) -> TrajectoryPoint:
        """Return the reference at ``time`` s since take-off."""
        t = time - plan.duration
        if t < 0.0:
            return sample_approach(plan, time)
        if t >= parameters.duration:
            return at_rest(curve(parameters, parameters.duration), t)
        return curve(parameters, t)

    return plan, duration, sample
