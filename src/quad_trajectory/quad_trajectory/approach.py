"""The way from where the vehicle is onto a curve, smooth to acceleration and jerk, within stated limits.

Two polynomials per axis: a transit that ends at rest, and a run-up from there that meets position, velocity,
acceleration and jerk of the curve's first point. A single polynomial over a long way would multiply the curve's
acceleration by the square of its duration and swing out; this one works from any distance.
"""

import math
from typing import NamedTuple

from quad_core.rotations import euler_from_quaternion, wrap_angle
from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_trajectory.limits import MotionLimits, turn_duration
from quad_trajectory.polynomial import Motion, Septic, evaluate, run_up_length, septic, smooth_step

QUANTUM = 0.25
"""s; the approach lasts a multiple of it: exact in binary, and a whole number of steps at the usual rates."""

SHORTEST = 1.0
SAMPLES = 100
END_MARGIN = 1.25
"""The approach may use so much of what its ends ask for, also where that is above the limits."""

SAMPLING_MARGIN = 0.995
RUN_UP_GROWTH = 1.02
RUN_UP_TRIES = 300


class Axes(NamedTuple):
    """One polynomial per world axis over a common duration in s; duration 0: there is no such part."""

    duration: float
    x: Septic
    y: Septic
    z: Septic


class Approach(NamedTuple):
    """The planned approach: transit, run-up and the yaw turn over both; ``duration`` 0 for none."""

    duration: float
    transit: Axes
    run_up: Axes
    yaw_from: float
    yaw_turn: float


class Allowed(NamedTuple):
    """Limits as the search uses them: speed m/s, acceleration m/s^2, jerk m/s^3, tangent of tilt, gravity m/s^2."""

    speed: float
    acceleration: float
    jerk: float
    tilt_tangent: float
    gravity: float


def plan_approach(limits: MotionLimits, gravity: float, start: VehicleState, first: TrajectoryPoint) -> Approach:
    """Return the shortest approach (in multiples of QUANTUM) from ``start`` to ``first`` within ``limits``.

    Begins with the position, velocity and yaw of ``start`` without acceleration, ends with p, v, a, jerk and yaw of
    ``first``. The search is a scan over durations with sampled limits, the same on every machine.
    """
    allowed = _allowed(limits, gravity, start, first)
    run_up = _plan_run_up(allowed, first)
    gate = Vec3(run_up.x.c0, run_up.y.c0, run_up.z.c0)
    yaw_from = euler_from_quaternion(start.q_wb).z
    yaw_turn = wrap_angle(first.yaw - yaw_from)
    shortest = turn_duration(limits, yaw_turn)
    way = math.sqrt(_square(gate.x - start.p_w.x, gate.y - start.p_w.y, gate.z - start.p_w.z)) / allowed.speed
    if way + run_up.duration > shortest:
        shortest = way + run_up.duration
    if shortest < SHORTEST:
        shortest = SHORTEST
    quanta = math.floor(shortest / QUANTUM) + 1
    transit = _transit(start, gate, quanta * QUANTUM - run_up.duration)
    while not _within(allowed, transit):
        quanta += 1 + quanta // 64
        transit = _transit(start, gate, quanta * QUANTUM - run_up.duration)
    return Approach(quanta * QUANTUM, transit, run_up, yaw_from, yaw_turn)


def no_approach() -> Approach:
    """Return the approach of a ``printed`` start: none, the reference steps to the curve at once."""
    nothing = Septic(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    axes = Axes(0.0, nothing, nothing, nothing)
    return Approach(0.0, axes, axes, 0.0, 0.0)


def sample_approach(approach: Approach, time: float) -> TrajectoryPoint:
    """Return the reference at ``time`` s after take-off, 0 <= time < duration of the approach."""
    if time < approach.transit.duration:
        axes = approach.transit
        since = time
    else:
        axes = approach.run_up
        since = time - approach.transit.duration
    x = evaluate(axes.x, axes.duration, since)
    y = evaluate(axes.y, axes.duration, since)
    z = evaluate(axes.z, axes.duration, since)
    yaw = smooth_step(approach.yaw_from, approach.yaw_from + approach.yaw_turn, approach.duration, time)
    return point(time - approach.duration, x, y, z, yaw)


def point(time: float, x: Motion, y: Motion, z: Motion, yaw: Motion) -> TrajectoryPoint:
    """Return the reference put together from its coordinates; ``time`` is t of eqs. 61-68."""
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


def held(last: TrajectoryPoint, time: float) -> TrajectoryPoint:
    """Return ``last`` at rest: what is flown to once the trajectory is over."""
    rest = Vec3(0.0, 0.0, 0.0)
    return TrajectoryPoint(time, last.p_w, rest, rest, rest, rest, last.yaw, 0.0, 0.0)


def _square(x: float, y: float, z: float) -> float:
    return x * x + y * y + z * z


def _larger(a: float, b: float) -> float:
    return a if a > b else b


def _allowed(limits: MotionLimits, gravity: float, start: VehicleState, first: TrajectoryPoint) -> Allowed:
    start_speed = math.sqrt(_square(start.v_w.x, start.v_w.y, start.v_w.z))
    end_speed = math.sqrt(_square(first.v_w.x, first.v_w.y, first.v_w.z))
    end_acceleration = math.sqrt(_square(first.a_w.x, first.a_w.y, first.a_w.z))
    end_jerk = math.sqrt(_square(first.jerk_w.x, first.jerk_w.y, first.jerk_w.z))
    lift = _larger(gravity + first.a_w.z, 0.1 * gravity)
    end_tangent = math.sqrt(_square(first.a_w.x, first.a_w.y, 0.0)) / lift
    return Allowed(
        _larger(limits.speed, END_MARGIN * _larger(start_speed, end_speed)),
        _larger(limits.acceleration, END_MARGIN * end_acceleration),
        _larger(limits.jerk, END_MARGIN * end_jerk),
        _larger(math.tan(limits.tilt), END_MARGIN * end_tangent),
        gravity,
    )


def _plan_run_up(allowed: Allowed, first: TrajectoryPoint) -> Axes:
    speed = math.sqrt(_square(first.v_w.x, first.v_w.y, first.v_w.z))
    if speed < 1e-9:
        x = Septic(first.p_w.x, 0.0, 0.0, 0.0, 0.0, 0.0)
        y = Septic(first.p_w.y, 0.0, 0.0, 0.0, 0.0, 0.0)
        z = Septic(first.p_w.z, 0.0, 0.0, 0.0, 0.0, 0.0)
        return Axes(0.0, x, y, z)
    level_speed = math.sqrt(_square(first.v_w.x, first.v_w.y, 0.0))
    level_acceleration = allowed.tilt_tangent * (allowed.gravity + allowed.acceleration)
    duration = _larger(speed / allowed.acceleration, level_speed / level_acceleration)
    run_up = _run_up(first, duration)
    tries = 0
    while tries < RUN_UP_TRIES and not _within(allowed, run_up):
        duration = RUN_UP_GROWTH * duration
        run_up = _run_up(first, duration)
        tries += 1
    return run_up


def _run_up(first: TrajectoryPoint, duration: float) -> Axes:
    x = Motion(first.p_w.x, first.v_w.x, first.a_w.x, first.jerk_w.x, 0.0)
    y = Motion(first.p_w.y, first.v_w.y, first.a_w.y, first.jerk_w.y, 0.0)
    z = Motion(first.p_w.z, first.v_w.z, first.a_w.z, first.jerk_w.z, 0.0)
    return Axes(
        duration,
        septic(x.p - run_up_length(x, duration), 0.0, x, duration),
        septic(y.p - run_up_length(y, duration), 0.0, y, duration),
        septic(z.p - run_up_length(z, duration), 0.0, z, duration),
    )


def _transit(start: VehicleState, gate: Vec3, duration: float) -> Axes:
    return Axes(
        duration,
        septic(start.p_w.x, start.v_w.x, Motion(gate.x, 0.0, 0.0, 0.0, 0.0), duration),
        septic(start.p_w.y, start.v_w.y, Motion(gate.y, 0.0, 0.0, 0.0, 0.0), duration),
        septic(start.p_w.z, start.v_w.z, Motion(gate.z, 0.0, 0.0, 0.0, 0.0), duration),
    )


def _within(allowed: Allowed, axes: Axes) -> bool:
    speed = SAMPLING_MARGIN * allowed.speed
    acceleration = SAMPLING_MARGIN * allowed.acceleration
    jerk = SAMPLING_MARGIN * allowed.jerk
    for i in range(SAMPLES + 1):
        time = axes.duration * i / SAMPLES
        x = evaluate(axes.x, axes.duration, time)
        y = evaluate(axes.y, axes.duration, time)
        z = evaluate(axes.z, axes.duration, time)
        if _square(x.v, y.v, z.v) > speed * speed or _square(x.a, y.a, z.a) > acceleration * acceleration:
            return False
        if _square(x.jerk, y.jerk, z.jerk) > jerk * jerk:
            return False
        if math.sqrt(_square(x.a, y.a, 0.0)) > SAMPLING_MARGIN * allowed.tilt_tangent * (allowed.gravity + z.a):
            return False
    return True
