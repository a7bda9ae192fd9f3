"""How long each segment of a minimum-snap path takes, within limits of speed, thrust, tilt, body rate and yaw.

Slowing a path down by a factor s divides velocity by s, acceleration by s^2 and jerk by s^3. From each sample follows
the factor that would just keep the limits there. Each segment is stretched or shortened by its own, damped, until all
use the limits alike; then the whole path is slowed down until every sample keeps them.
"""

import math
from typing import NamedTuple

from numpy import zeros

from quad_trajectory.limits import MotionLimits, turn_duration
from quad_trajectory.minimum_snap import Table, axis_at, solved_path
from quad_trajectory.polynomial import AxisPoint

SAMPLES = 16
ROUNDS = 12
DAMPING = 0.5
FINE_SAMPLES = 48
SLOWER = 1.004
ACCEPTED = 0.997
"""Factors for what lies between two samples: how much slower than they ask for, and how close to that is accepted."""

SLOWING_TRIES = 100


class PathLimits(NamedTuple):
    """Speed m/s, specific thrust at most and at least m/s^2, tangent of tilt, body rate rad/s, gravity m/s^2."""

    speed: float
    max_thrust: float
    min_thrust: float
    tilt_tangent: float
    body_rate: float
    gravity: float


def allocated_path(points: Table, limits: PathLimits, turns: MotionLimits) -> Table:
    """Return the fastest path found through ``points`` (rows x, y, z, yaw) within ``limits`` and those of ``turns``.

    Raises ValueError if slowing down does not bring it within the limits.
    """
    times = first_times(points, limits, turns)
    best = zeros(len(times))
    shortest = math.inf
    factors = zeros(len(times))
    for _ in range(ROUNDS):
        path = solved_path(points, times)
        worst, total = 0.0, 0.0
        for segment in range(len(times)):
            factors[segment] = segment_factor(path, segment, limits, turns, SAMPLES)
            worst = max(float(factors[segment]), worst)
            total += float(times[segment])
        if worst * total < shortest:
            shortest = worst * total
            best = worst * times
        times = times * (1.0 + DAMPING * (factors / worst - 1.0)) * worst
    return slowed_path(points, best, limits, turns)


def slowed_path(points: Table, times: Table, limits: PathLimits, turns: MotionLimits) -> Table:
    """Return the path with ``times`` scaled by one factor so that it keeps the limits."""
    path = solved_path(points, times)
    for _ in range(SLOWING_TRIES):
        worst = 0.0
        for segment in range(len(times)):
            worst = max(segment_factor(path, segment, limits, turns, FINE_SAMPLES), worst)
        if worst <= ACCEPTED:
            return path
        times = SLOWER * worst * times
        path = solved_path(points, times)
    raise ValueError("waypoints: no time allocation keeps the limits of speed, thrust, tilt, body rate and yaw")


def first_times(points: Table, limits: PathLimits, turns: MotionLimits) -> Table:
    """Return times in s to begin with: each segment as if flown from rest to rest with half the thrust to spare."""
    times = zeros(len(points) - 1)
    room = 0.5 * (limits.max_thrust - limits.gravity)
    for i in range(len(times)):
        x, y = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        z = points[i + 1, 2] - points[i, 2]
        distance = math.sqrt(x * x + y * y + z * z)
        yaw_time = turn_duration(turns, float(points[i + 1, 3] - points[i, 3]))
        times[i] = max(yaw_time, distance / limits.speed + math.sqrt(distance / room))
    return times


def segment_factor(path: Table, segment: int, limits: PathLimits, turns: MotionLimits, samples: int) -> float:
    """Return by which factor a segment has to be slower to keep the limits; below 1: it may be faster."""
    turn = turn_duration(turns, float(path[segment, 3] - path[segment, 2]))
    factor = turn / float(path[segment, 1])
    for i in range(samples + 1):
        u = i / samples
        x, y, z = axis_at(path, segment, 0, u), axis_at(path, segment, 1, u), axis_at(path, segment, 2, u)
        factor = max(sample_factor(x, y, z, limits), factor)
    return factor


def sample_factor(x: AxisPoint, y: AxisPoint, z: AxisPoint, limits: PathLimits) -> float:
    """Return by which factor a path has to be slower to keep the limits at one point, the thrust direction kept."""
    g = limits.gravity
    factor = math.sqrt(x.v * x.v + y.v * y.v + z.v * z.v) / limits.speed
    across2 = x.a * x.a + y.a * y.a
    whole2 = across2 + z.a * z.a
    if whole2 > 0.0:
        spare = g * g * z.a * z.a + whole2 * (limits.max_thrust * limits.max_thrust - g * g)
        factor = max(math.sqrt(whole2 / (math.sqrt(spare) - g * z.a)), factor)
    if z.a < 0.0:
        factor = max(math.sqrt(-z.a / (g - limits.min_thrust)), factor)
    tilting = math.sqrt(across2) - limits.tilt_tangent * z.a
    if tilting > 0.0:
        factor = max(math.sqrt(tilting / (limits.tilt_tangent * g)), factor)
    return max(math.sqrt(math.sqrt(body_rate(x, y, z, g) / limits.body_rate)), factor)


def body_rate(x: AxisPoint, y: AxisPoint, z: AxisPoint, gravity: float) -> float:
    """Return the rate in rad/s at which the direction of the specific thrust (a + g) turns: |f x jerk| / f^2."""
    lift = z.a + gravity
    across_x = y.a * z.jerk - lift * y.jerk
    across_y = lift * x.jerk - x.a * z.jerk
    across_z = x.a * y.jerk - y.a * x.jerk
    thrust2 = x.a * x.a + y.a * y.a + lift * lift
    if thrust2 <= 0.0:
        return math.inf
    return math.sqrt(across_x * across_x + across_y * across_y + across_z * across_z) / thrust2
