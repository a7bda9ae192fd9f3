"""References of TAKEOFF, HOLD, LAND and of the way to a place: from any current reference to rest, jerk-limited.

Per axis two parts of constant jerk: the quickest stop from (v, a) to rest,

    a: a0 -> -a_p -> 0,   a_p = min(a_max, sqrt(j v0 + a0^2 / 2)),

and from there the symmetric rest-to-rest way to a target, if there is one. Position, velocity and acceleration are
continuous at the change of mode, whatever the mission flew. ``ModeReference`` does the rest:

    plan = plan_mode(limits, mode, current reference, ground height, take-off height, place)   # when an act begins
    reference = sample(plan, time since then)                                                  # at every step

The way back into a mission adds what the mission's first point differs from the current reference, and lets that
offset go to rest at zero the same way: ``plan_hand_over`` once, ``handed_over`` at every step.
"""

import math
from typing import NamedTuple

from quad_commander.parameters import AxisLimits, ReferenceLimits
from quad_core.enumerations import Mode
from quad_core.geometry import euler_from_quaternion, wrap_angle
from quad_core.types import TrajectoryPoint, VehicleState
from quad_trajectory.polynomial import AxisPoint, constant_jerk, coordinates, evaluate, point, resting


class Place(NamedTuple):
    """Where to fly: world frame, m; ``yaw`` in rad, None to keep the heading."""

    x: float
    y: float
    z: float
    yaw: float | None = None

    def __str__(self) -> str:
        """Return it as ``missions.read_place`` reads it."""
        yaw = "" if self.yaw is None else f" {math.degrees(self.yaw):g}deg"
        return f"{self.x:g} {self.y:g} {self.z:g}{yaw}"


class AxisPlan(NamedTuple):
    """One coordinate: its start, (duration in s, jerk) of each segment, where it comes to rest and when in s."""

    start: AxisPoint
    segments: tuple[tuple[float, float], ...]
    end: float
    duration: float


class ReferencePlan(NamedTuple):
    """The reference of a mode: x, y, z, yaw; at rest from ``duration`` s on."""

    axes: tuple[AxisPlan, ...]
    duration: float


def plan_mode(
    limits: ReferenceLimits,
    mode: Mode,
    current: TrajectoryPoint,
    ground_height: float,
    takeoff_height: float,
    place: Place | None = None,
) -> ReferencePlan:
    """Return the plan of ``mode`` from the ``current`` reference on; heights in m, take-off's above the ground.

    TAKEOFF stops and rises, LAND stops and sinks, every other mode stops, and flies to ``place`` if there is one. None
    sinks to take off or rises to land.
    """
    each = (limits.horizontal, limits.horizontal, limits.landing if mode == Mode.LAND else limits.climb, limits.yaw)
    x, y, z, yaw = (stopped(bound, motion) for bound, motion in zip(each, motions(current), strict=True))
    if mode == Mode.TAKEOFF and z.end < ground_height + takeoff_height:
        z = moved(each[2], z, ground_height + takeoff_height)
    elif mode == Mode.LAND and z.end > ground_height - limits.landing_depth:
        z = moved(each[2], z, ground_height - limits.landing_depth)
    elif place is not None:
        x, y, z = moved(each[0], x, place.x), moved(each[1], y, place.y), moved(each[2], z, place.z)
        if place.yaw is not None:
            yaw = moved(limits.yaw, yaw, yaw.end + wrap_angle(place.yaw - yaw.end))
    return _together((x, y, z, yaw))


def plan_hand_over(limits: ReferenceLimits, current: TrajectoryPoint, mission: TrajectoryPoint) -> ReferencePlan:
    """Return how the difference of ``current`` from the ``mission``'s first point goes to zero."""
    each = (limits.horizontal, limits.horizontal, limits.climb, limits.yaw)
    pairs = zip(motions(current), motions(mission), strict=True)
    offsets = [AxisPoint(here.p - there.p, here.v - there.v, here.a - there.a, 0.0, 0.0) for here, there in pairs]
    offsets[3] = offsets[3]._replace(p=wrap_angle(offsets[3].p))
    return _together(tuple(moved(bound, stopped(bound, way), 0.0) for bound, way in zip(each, offsets, strict=True)))


def handed_over(plan: ReferencePlan, time: float, mission: TrajectoryPoint) -> TrajectoryPoint:
    """Return the ``mission``'s point plus what is left of the difference ``time`` s after the hand-over."""
    if time >= plan.duration:
        return mission
    pairs = zip(motions(mission), motions(sample(plan, time)), strict=True)
    axes = [AxisPoint(*(there + rest for there, rest in zip(*pair, strict=True))) for pair in pairs]
    return point(mission.trajectory_time, *axes)._replace(snap_w=mission.snap_w)


def continued(current: TrajectoryPoint, time: float) -> TrajectoryPoint:
    """Return the ``current`` point carried on for ``time`` s with its own derivatives up to the jerk."""
    if time == 0.0:
        return current
    carried = point(current.trajectory_time + time, *(advanced(axis, axis.jerk, time) for axis in motions(current)))
    return carried._replace(snap_w=current.snap_w)


def from_state(state: VehicleState) -> TrajectoryPoint:
    """Return the reference that a vehicle flies which followed none (after DESCEND): its own motion."""
    return TrajectoryPoint(0.0, state.p_w, state.v_w, yaw=euler_from_quaternion(state.q_wb).z)


def beside(current: TrajectoryPoint, other: TrajectoryPoint) -> TrajectoryPoint:
    """Return the ``current`` point with the horizontal motion of ``other``."""
    return point(current.trajectory_time, *motions(other)[:2], *motions(current)[2:])


def sample(plan: ReferencePlan, time: float) -> TrajectoryPoint:
    """Return the reference ``time`` s after the plan was made; ``trajectory_time`` is negative until it is at rest."""
    return point(min(time - plan.duration, 0.0), *(at(axis, time) for axis in plan.axes))


def motions(current: TrajectoryPoint) -> list[AxisPoint]:
    """Return the motion of x, y, z and yaw."""
    return [*coordinates(current), AxisPoint(current.yaw, current.yaw_rate, current.yaw_acceleration, 0.0, 0.0)]


def at(plan: AxisPlan, time: float) -> AxisPoint:
    """Return the motion of one coordinate ``time`` s after its start."""
    if time >= plan.duration:
        return resting(plan.end)
    motion = plan.start
    for duration, jerk in plan.segments:
        if time < duration:
            return advanced(motion, jerk, time)
        motion = advanced(motion, jerk, duration)
        time -= duration
    return motion


def advanced(motion: AxisPoint, jerk: float, time: float) -> AxisPoint:
    """Return the motion ``time`` s later under constant ``jerk``."""
    return evaluate(constant_jerk(motion, jerk), 1.0, time)


def stopped(limits: AxisLimits, start: AxisPoint) -> AxisPlan:
    """Return the quickest way from (v, a) to rest within acceleration and jerk."""
    jerk = limits.jerk
    # where the speed ends if the acceleration is given up at once: that way the rest has to be braked
    left = start.v + start.a * abs(start.a) / (2.0 * jerk)
    sign = 1.0 if left >= 0.0 else -1.0
    v, a = sign * start.v, sign * start.a
    peak = min(math.sqrt(max(jerk * v + 0.5 * a * a, 0.0)), limits.acceleration)
    first = abs(a + peak) / jerk
    after = v + 0.5 * (a - peak) * first - 0.5 * peak * peak / jerk
    middle = max(after, 0.0) / peak if peak > 0.0 else 0.0
    up = -sign * jerk if a > -peak else sign * jerk
    motion = start = start._replace(jerk=0.0)
    segments = ((first, up), (middle, 0.0), (peak / jerk, sign * jerk))
    for time, constant in segments:
        motion = advanced(motion, constant, time)
    return AxisPlan(start, segments, motion.p, first + middle + peak / jerk)


def moved(limits: AxisLimits, stop: AxisPlan, target: float) -> AxisPlan:
    """Return ``stop`` continued to rest at ``target``."""
    way = target - stop.end
    ramp, constant, cruise = rest_to_rest(limits, abs(way))
    jerk = math.copysign(limits.jerk, way)
    speed_up = ((ramp, jerk), (constant, 0.0), (ramp, -jerk))
    slow_down = ((ramp, -jerk), (constant, 0.0), (ramp, jerk))
    duration = stop.duration + 4.0 * ramp + 2.0 * constant + cruise
    return AxisPlan(stop.start, (*stop.segments, *speed_up, (cruise, 0.0), *slow_down), target, duration)


def rest_to_rest(limits: AxisLimits, way: float) -> tuple[float, float, float]:
    """Return the times in s of a jerk, of constant acceleration and of constant speed over ``way`` m >= 0."""
    speed, acceleration, jerk = limits
    ramp = acceleration / jerk
    fastest = 0.5 * acceleration * (math.sqrt(ramp * ramp + 4.0 * way / acceleration) - ramp)
    if fastest < acceleration * ramp:  # the way ends before the acceleration is reached
        fastest = (0.25 * jerk * way * way) ** (1.0 / 3.0)
    fastest = min(fastest, speed)
    ramp = min(ramp, math.sqrt(fastest / jerk))
    constant = max(fastest / acceleration - ramp, 0.0)
    return ramp, constant, max(way - fastest * (2.0 * ramp + constant), 0.0) / speed


def _together(axes: tuple[AxisPlan, ...]) -> ReferencePlan:
    return ReferencePlan(axes, max(axis.duration for axis in axes))
