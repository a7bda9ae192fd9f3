"""References of TAKEOFF, HOLD and LAND: from any current reference to rest, jerk-limited.

Per axis two parts of constant jerk: the quickest stop from (v, a) to rest,

    a: a0 -> -a_p -> 0,   a_p = min(a_max, sqrt(j v0 + a0^2 / 2)),

and from there the symmetric rest-to-rest way to a target, if there is one. Position, velocity and acceleration are
continuous at the change of mode, whatever the mission flew. The node's part:

    plan = plan_mode(limits, mode, current reference, ground height, take-off height)      when the mode changes
    reference = sample(plan, time since then)                                              at every step
    reference_done = time >= plan.duration

The way back into a mission adds what the mission's first point differs from the current reference, and lets that
offset go to rest at zero the same way: ``plan_hand_over`` once, ``handed_over`` at every step.
"""

import math
from typing import NamedTuple

from quad_commander.mode_table import Mode
from quad_commander.parameters import AxisLimits, ReferenceLimits
from quad_core.geometry import add, euler_from_quaternion, wrap_angle
from quad_core.types import TrajectoryPoint, Vec3, VehicleState

TAKEOFF, LAND = Mode.TAKEOFF.value, Mode.LAND.value
THIRD = 1.0 / 3.0
SEGMENTS = 10
Times = tuple[float, float, float, float, float, float, float, float, float, float]


class AxisPlan(NamedTuple):
    """One coordinate: where it starts, durations in s and jerks of its segments, where it comes to rest and when."""

    p: float
    v: float
    a: float
    times: Times
    jerks: Times
    end: float
    duration: float


class Motion(NamedTuple):
    """Position, velocity, acceleration and jerk of one coordinate."""

    p: float
    v: float
    a: float
    jerk: float


class ReferencePlan(NamedTuple):
    """The reference of a mode: x, y, z, yaw; at rest from ``duration`` s on."""

    x: AxisPlan
    y: AxisPlan
    z: AxisPlan
    yaw: AxisPlan
    duration: float


def plan_mode(
    limits: ReferenceLimits, mode: int, current: TrajectoryPoint, ground_height: float, takeoff_height: float
) -> ReferencePlan:
    """Return the plan of ``mode`` from the ``current`` reference on; heights in m, take-off's above the ground.

    TAKEOFF stops and rises, LAND stops and sinks, every other mode stops. None sinks to take off or rises to land.
    """
    vertical = limits.landing if mode == LAND else limits.climb
    z = stopped(vertical, current.p_w.z, current.v_w.z, current.a_w.z)
    if mode == TAKEOFF and z.end < ground_height + takeoff_height:
        z = moved(vertical, z, ground_height + takeoff_height)
    if mode == LAND and z.end > ground_height - limits.landing_depth:
        z = moved(vertical, z, ground_height - limits.landing_depth)
    x = stopped(limits.horizontal, current.p_w.x, current.v_w.x, current.a_w.x)
    y = stopped(limits.horizontal, current.p_w.y, current.v_w.y, current.a_w.y)
    yaw = stopped(limits.yaw, current.yaw, current.yaw_rate, current.yaw_acceleration)
    return ReferencePlan(x, y, z, yaw, longest(x, y, z, yaw))


def plan_hand_over(limits: ReferenceLimits, current: TrajectoryPoint, mission: TrajectoryPoint) -> ReferencePlan:
    """Return how the difference of ``current`` from the ``mission``'s first point goes to zero."""
    x = brought_to(
        limits.horizontal, current.p_w.x - mission.p_w.x, current.v_w.x - mission.v_w.x, current.a_w.x - mission.a_w.x
    )
    y = brought_to(
        limits.horizontal, current.p_w.y - mission.p_w.y, current.v_w.y - mission.v_w.y, current.a_w.y - mission.a_w.y
    )
    z = brought_to(
        limits.climb, current.p_w.z - mission.p_w.z, current.v_w.z - mission.v_w.z, current.a_w.z - mission.a_w.z
    )
    yaw = brought_to(
        limits.yaw,
        wrap_angle(current.yaw - mission.yaw),
        current.yaw_rate - mission.yaw_rate,
        current.yaw_acceleration - mission.yaw_acceleration,
    )
    return ReferencePlan(x, y, z, yaw, longest(x, y, z, yaw))


def handed_over(plan: ReferencePlan, time: float, mission: TrajectoryPoint) -> TrajectoryPoint:
    """Return the ``mission``'s point plus what is left of the difference ``time`` s after the hand-over."""
    if time >= plan.duration:
        return mission
    rest = sample(plan, time)
    return TrajectoryPoint(
        mission.trajectory_time,
        add(mission.p_w, rest.p_w),
        add(mission.v_w, rest.v_w),
        add(mission.a_w, rest.a_w),
        add(mission.jerk_w, rest.jerk_w),
        mission.snap_w,
        mission.yaw + rest.yaw,
        mission.yaw_rate + rest.yaw_rate,
        mission.yaw_acceleration + rest.yaw_acceleration,
    )


def continued(point: TrajectoryPoint, time: float) -> TrajectoryPoint:
    """Return ``point`` carried on for ``time`` s with its own derivatives up to the jerk."""
    if time == 0.0:
        return point
    axes = zip(point.p_w, point.v_w, point.a_w, point.jerk_w, strict=True)
    x, y, z = (advanced(Motion(p, v, a, jerk), jerk, time) for p, v, a, jerk in axes)
    yaw = advanced(Motion(point.yaw, point.yaw_rate, point.yaw_acceleration, 0.0), 0.0, time)
    return TrajectoryPoint(
        point.trajectory_time + time,
        Vec3(x.p, y.p, z.p),
        Vec3(x.v, y.v, z.v),
        Vec3(x.a, y.a, z.a),
        point.jerk_w,
        point.snap_w,
        yaw.p,
        yaw.v,
        yaw.a,
    )


def standing(state: VehicleState) -> TrajectoryPoint:
    """Return the reference of a vehicle that stands where it is."""
    zero = Vec3(0.0, 0.0, 0.0)
    return from_state(state)._replace(v_w=zero)


def from_state(state: VehicleState) -> TrajectoryPoint:
    """Return the reference that a vehicle flies which followed none (after DESCEND): its own motion."""
    zero = Vec3(0.0, 0.0, 0.0)
    yaw = euler_from_quaternion(state.q_wb).z
    return TrajectoryPoint(0.0, state.p_w, state.v_w, zero, zero, zero, yaw, 0.0, 0.0)


def above(point: TrajectoryPoint, state: VehicleState) -> TrajectoryPoint:
    """Return ``point`` moved to where the vehicle is, at its own height: a vehicle on the ground must not tilt."""
    return point._replace(p_w=Vec3(state.p_w.x, state.p_w.y, point.p_w.z))


def beside(point: TrajectoryPoint, other: TrajectoryPoint) -> TrajectoryPoint:
    """Return ``point`` with the horizontal motion of ``other``."""
    pairs = ((getattr(point, name), getattr(other, name)) for name in ("p_w", "v_w", "a_w", "jerk_w"))
    p, v, a, jerk = (Vec3(aside.x, aside.y, own.z) for own, aside in pairs)
    return point._replace(p_w=p, v_w=v, a_w=a, jerk_w=jerk)


def sample(plan: ReferencePlan, time: float) -> TrajectoryPoint:
    """Return the reference ``time`` s after the plan was made; ``trajectory_time`` is negative until it is at rest."""
    x, y, z, yaw = at(plan.x, time), at(plan.y, time), at(plan.z, time), at(plan.yaw, time)
    return TrajectoryPoint(
        time - plan.duration if time < plan.duration else 0.0,
        Vec3(x.p, y.p, z.p),
        Vec3(x.v, y.v, z.v),
        Vec3(x.a, y.a, z.a),
        Vec3(x.jerk, y.jerk, z.jerk),
        Vec3(0.0, 0.0, 0.0),
        yaw.p,
        yaw.v,
        yaw.a,
    )


def at(plan: AxisPlan, time: float) -> Motion:
    """Return the motion of one coordinate ``time`` s after its start."""
    if time >= plan.duration:
        return Motion(plan.end, 0.0, 0.0, 0.0)
    motion = Motion(plan.p, plan.v, plan.a, 0.0)
    left = time
    for i in range(SEGMENTS):
        if left < plan.times[i]:
            return advanced(motion, plan.jerks[i], left)
        motion = advanced(motion, plan.jerks[i], plan.times[i])
        left = left - plan.times[i]
    return motion


def advanced(motion: Motion, jerk: float, time: float) -> Motion:
    """Return the motion ``time`` s later under constant ``jerk``."""
    p, v, a, _ = motion
    return Motion(
        p + time * (v + time * (0.5 * a + time * jerk / 6.0)), v + time * (a + 0.5 * time * jerk), a + time * jerk, jerk
    )


def stopped(limits: AxisLimits, p: float, v: float, a: float) -> AxisPlan:
    """Return the quickest way from (v, a) to rest within acceleration and jerk."""
    jerk = limits.jerk
    # where the speed ends if the acceleration is given up at once: that way the rest has to be braked
    left = v + a * abs(a) / (2.0 * jerk)
    sign = 1.0 if left >= 0.0 else -1.0
    v, a = sign * v, sign * a
    square = jerk * v + 0.5 * a * a
    peak = math.sqrt(square) if square > 0.0 else 0.0
    if peak > limits.acceleration:
        peak = limits.acceleration
    first = abs(a + peak) / jerk
    after = v + 0.5 * (a - peak) * first - 0.5 * peak * peak / jerk
    middle = after / peak if peak > 0.0 and after > 0.0 else 0.0
    times = (first, middle, peak / jerk, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    one = -sign * jerk if a > -peak else sign * jerk
    jerks = (one, 0.0, sign * jerk, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return finished(p, sign * v, sign * a, times, jerks)


def moved(limits: AxisLimits, stop: AxisPlan, target: float) -> AxisPlan:
    """Return ``stop`` continued to rest at ``target``."""
    way = target - stop.end
    sign = 1.0 if way >= 0.0 else -1.0
    ramp, constant, cruise = rest_to_rest(limits, abs(way))
    jerk = sign * limits.jerk
    t, j = stop.times, stop.jerks
    times = (t[0], t[1], t[2], ramp, constant, ramp, cruise, ramp, constant, ramp)
    jerks = (j[0], j[1], j[2], jerk, 0.0, -jerk, 0.0, -jerk, 0.0, jerk)
    duration = stop.duration + 4.0 * ramp + 2.0 * constant + cruise
    return AxisPlan(stop.p, stop.v, stop.a, times, jerks, target, duration)


def brought_to(limits: AxisLimits, p: float, v: float, a: float) -> AxisPlan:
    """Return the way of one coordinate to rest at zero."""
    return moved(limits, stopped(limits, p, v, a), 0.0)


def rest_to_rest(limits: AxisLimits, way: float) -> tuple[float, float, float]:
    """Return the times in s of a jerk, of constant acceleration and of constant speed over ``way`` m >= 0."""
    speed, acceleration, jerk = limits
    ramp = acceleration / jerk
    constant = speed / acceleration - ramp
    if constant < 0.0:
        ramp, constant = math.sqrt(speed / jerk), 0.0
    needed = speed * (2.0 * ramp + constant)
    if way >= needed:
        return ramp, constant, (way - needed) / speed
    ramp = acceleration / jerk
    peak = 0.5 * acceleration * (math.sqrt(ramp * ramp + 4.0 * way / acceleration) - ramp)
    constant = peak / acceleration - ramp
    if constant < 0.0:
        ramp, constant = abs(way / (2.0 * jerk)) ** THIRD, 0.0
    return ramp, constant, 0.0


def finished(p: float, v: float, a: float, times: Times, jerks: Times) -> AxisPlan:
    """Return the plan with its end, where the speed is zero but for rounding."""
    motion = Motion(p, v, a, 0.0)
    duration = 0.0
    for i in range(SEGMENTS):
        motion = advanced(motion, jerks[i], times[i])
        duration += times[i]
    return AxisPlan(p, v, a, times, jerks, motion.p, duration)


def longest(x: AxisPlan, y: AxisPlan, z: AxisPlan, yaw: AxisPlan) -> float:
    """Return the duration in s after which all four coordinates are at rest."""
    duration = x.duration if x.duration > y.duration else y.duration
    duration = z.duration if z.duration > duration else duration
    return yaw.duration if yaw.duration > duration else duration
