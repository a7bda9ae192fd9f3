"""Waypoints: the minimum-snap path through given points, as fast as limits of speed, thrust, tilt and body rate allow.

    min int |p''''(t)|^2 dt,    p(t_i) = waypoint i,    at rest at both ends        (Mellinger and Kumar, ICRA 2011)

The times t_i follow from the limits (``minimum_snap``). The heading turns smoothly between waypoints. The first
waypoint is reached by an approach, at the last one the vehicle stays.

As text they stand one a line (or after a semicolon). What is not understood is refused with its line.
"""

import math
import re
from typing import Annotated, NamedTuple

import numpy as np

from quad_core.parameters import ParameterError, Real, Text
from quad_core.types import TrajectoryPoint, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory.approach import Approach, Entry, Start, plan_approach, sample_approach
from quad_trajectory.limits import MotionLimits
from quad_trajectory.minimum_snap import Table, allocated_path, axis_at, path_limits
from quad_trajectory.polynomial import at_rest, point, smooth_step


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


MOST_POINTS = 32
FARTHEST = 1e4
CLOSEST = 0.01  # m; between two waypoints, below which the path between them is no path

_NUMBER = re.compile(r"[+-]?\d+(\.\d+)?|[+-]?\.\d+", re.ASCII)
_TURN = 2.0 * math.pi


def written_points(text: str) -> list[list[float]]:
    """Return x, y, z in m and, where it is written, yaw in rad of each waypoint.

    Raises ParameterError, naming the line, if ``text`` is not 2 to MOST_POINTS waypoints apart from each other.
    """
    points: list[list[float]] = []
    for count, line in enumerate(re.split(r"[\n;]", text), 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        where = f"points: waypoint {len(points) + 1} (line {count}): found {line.strip()!r}, expected"
        if len(words) not in (3, 4):
            raise ParameterError(f"{where} x y z in m and, if it changes, yaw in rad (or 90deg)")
        for word in (*words[:3], *(yaw.removesuffix("deg") for yaw in words[3:])):
            if not _NUMBER.fullmatch(word):
                raise ParameterError(f"{where} numbers as 12.5, not {word!r}")
        values = [math.radians(float(word[:-3])) if word.endswith("deg") else float(word) for word in words]
        if max(map(abs, values[:3])) > FARTHEST:
            raise ParameterError(f"{where} x y z in [-{FARTHEST:g}, {FARTHEST:g}] m")
        if len(values) == 4 and abs(values[3]) > _TURN:
            hint = "" if words[3].endswith("deg") else f"; for degrees write {words[3]}deg"
            raise ParameterError(f"{where} a yaw of at most one turn, 6.2831 rad or 360deg, either way{hint}")
        if points and math.dist(points[-1][:3], values[:3]) < CLOSEST:
            raise ParameterError(f"{where} a waypoint at least {CLOSEST} m from the one before")
        points.append(values)
    if not 2 <= len(points) <= MOST_POINTS:
        raise ParameterError(f"points: found {len(points)} waypoints, expected 2 to {MOST_POINTS}")
    return points


def read_points(text: str) -> Table:
    """Return the waypoints as rows (x, y, z in m, yaw in rad); a yaw holds until the next. Raises ParameterError.

    Whole turns are added to a yaw so that it is within half a turn of the one before.
    """
    rows: list[list[float]] = []
    for x, y, z, *yaw in written_points(text):
        before = rows[-1][3] if rows else None
        turned = yaw[0] if yaw else before or 0.0
        if before is not None:
            turned -= _TURN * math.floor((turned - before) / _TURN + 0.5)
        rows.append([x, y, z, turned])
    return np.array(rows)


def long_turns(text: str) -> list[str]:
    """Return a sentence for each waypoint whose yaw, as written, is over half a turn away."""
    flown, found, before = read_points(text)[:, 3], [], 0.0
    for row, (_, _, _, *yaw) in enumerate(written_points(text)):
        written = yaw[0] if yaw else before
        long, short, before = written - before, flown[row] - flown[row - 1], written
        if row and abs(long - short) > 1e-9:
            found.append(
                f"waypoint {row + 1}: the heading turns {math.degrees(short):.0f} deg, not {math.degrees(long):.0f} deg"
                " (for the long way write a waypoint between)"
            )
    return found
