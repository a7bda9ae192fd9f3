"""Waypoints: the minimum-snap path through given points, as fast as limits of speed, thrust, tilt and body rate allow.

    min int |p''''(t)|^2 dt,    p(t_i) = waypoint i,    at rest at both ends        (Mellinger and Kumar, ICRA 2011)

The times t_i follow from the limits (``time_allocation``). The heading turns smoothly between waypoints. The first
waypoint is reached by an approach, at the last one the vehicle stays.
"""

from typing import Annotated, NamedTuple

from quad_core.parameters import Real, Text
from quad_core.types import TrajectoryPoint, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory.approach import Approach, Entry, Start, plan_approach, sample_approach
from quad_trajectory.limits import MotionLimits
from quad_trajectory.minimum_snap import Table, axis_at
from quad_trajectory.polynomial import at_rest, point, smooth_step
from quad_trajectory.time_allocation import allocated_path, path_limits
from quad_trajectory.waypoint_text import long_turns, read_points


class Parameters(NamedTuple):
    """Waypoints: how the first is reached, where they are, and within which limits they are flown."""

    start: Entry = Start.APPROACH.value
    points: Annotated[
        str,
        Text("waypoints, one a line or separated by semicolons: x y z in m and, where it changes, yaw in rad or 90deg"),
    ] = "0 0 2; 6 0 3; 6 6 4; 0 6 3; 0 0 2"
    speed: Annotated[float, Real("m/s", "speed limit of the path", 0.01, 100.0)] = 5.0
    thrust: Annotated[float, Real("", "thrust limit of the path over the vehicle's largest thrust", 0.1, 1.0)] = 0.7
    tilt: Annotated[float, Real("rad", "tilt limit of the path", 0.01, 1.4)] = 0.6
    body_rate: Annotated[
        float, Real("rad/s", "largest turn rate of the thrust direction along the path", 0.05, 30.0)
    ] = 2.0
    stay: Annotated[float, Real("s", "flight time at the last waypoint", 0.01, 1e5)] = 2.0
    limits: MotionLimits = MotionLimits()


class Plan(NamedTuple):
    """The approach, the path (a row per segment, columns: ``minimum_snap.COEFFICIENTS``) and its duration in s."""

    approach: Approach
    path: Table
    duration: float


def check(parameters: Parameters) -> None:
    """Raise ParameterError naming the first line that is not a waypoint."""
    read_points(parameters.points)


def remarks(parameters: Parameters) -> list[str]:
    """Return a sentence for each turn that is flown the short way although the long way was written."""
    return long_turns(parameters.points)


def plan(parameters: Parameters, vehicle: Vehicle, start: VehicleState) -> Plan:
    """Return the path, and how its first waypoint is reached from ``start``.

    Raises ValueError if the thrust limit is below the weight, or nothing keeps the limits.
    """
    limits = path_limits("waypoints", parameters, vehicle)
    path = allocated_path(read_points(parameters.points), limits, parameters.limits)
    last = len(path) - 1
    approach = plan_approach(parameters.start, parameters.limits, vehicle.gravity, start, along(path, 0.0))
    return Plan(approach, path, float(path[last, 0]) + float(path[last, 1]))


def duration(parameters: Parameters, plan: Plan) -> float:
    """Return the end of the flight in s since take-off."""
    return plan.approach.duration + plan.duration + parameters.stay


def sample(parameters: Parameters, plan: Plan, time: float) -> TrajectoryPoint:  # noqa: ARG001
    """Return the reference at ``time`` s since take-off; at rest on the last waypoint from the end of the path on."""
    t = time - plan.approach.duration
    if t < 0.0:
        return sample_approach(plan.approach, time)
    if t >= plan.duration:
        return at_rest(along(plan.path, plan.duration), t)
    return along(plan.path, t)


def along(path: Table, t: float) -> TrajectoryPoint:
    """Return the reference at ``t`` s along the path, from 0 to its duration."""
    segment = 0
    while segment < len(path) - 1 and t >= float(path[segment + 1, 0]):
        segment += 1
    since, length = t - float(path[segment, 0]), float(path[segment, 1])
    yaw = smooth_step(float(path[segment, 2]), float(path[segment, 3]), length, since)
    x, y, z = (axis_at(path, segment, 0, since), axis_at(path, segment, 1, since), axis_at(path, segment, 2, since))
    return point(t, x, y, z, yaw)
