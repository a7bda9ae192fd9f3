"""Minimum-snap paths: of all paths through the waypoints at given times, the one with the least integral of snap^2.

    min int |snap(t)|^2 dt,    p(t_i) = waypoint i,    v = a = jerk = 0 at both ends    (Mellinger and Kumar, ICRA 2011)

Between two waypoints it is a polynomial of degree 7; at each inner waypoint derivatives 1 to 6 are continuous. Unknown
are velocity, acceleration and jerk at the inner waypoints: the gradient of the cost by them is the jump of derivatives
6, 5 and 4, a symmetric, positive definite system.

The times keep limits of speed, thrust, tilt, body rate and yaw. Slowing a path down by a factor s divides velocity by
s, acceleration by s^2 and jerk by s^3. From each sample follows the factor that would just keep the limits there. Each
segment is stretched or shortened by its own, damped, until all use the limits alike; then the whole path is slowed down
until every sample keeps them.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.vehicle import Vehicle, max_thrust
from quad_trajectory.limits import MotionLimits, turn_duration
from quad_trajectory.polynomial import AxisPoint, Polynomial, evaluate, septic

Table = NDArray[np.float64]

COST = np.array(
    [
        [1080.0, 225.0, 20.0, 1020.0, -195.0, 15.0],
        [225.0, 50.0, 5.0, 195.0, -35.0, 2.5],
        [20.0, 5.0, 2.0 / 3.0, 15.0, -2.5, 1.0 / 6.0],
        [1020.0, 195.0, 15.0, 1080.0, -225.0, 20.0],
        [-195.0, -35.0, -2.5, -225.0, 50.0, -5.0],
        [15.0, 2.5, 1.0 / 6.0, 20.0, -5.0, 2.0 / 3.0],
    ]
)
"""Second derivatives of the integral of snap^2 over a segment of 1 s by v, a, jerk at its begin and its end, / 48."""

RISE = np.array([2100.0, 420.0, 35.0, 2100.0, -420.0, 35.0])
"""Minus the mixed second derivatives by those and by the rise of the segment, / 48."""

FIRST_COEFFICIENT = 4
COEFFICIENTS = len(Polynomial._fields)
"""Columns of a path: begin s, duration s, yaw at begin and end rad, then the coefficients (m) of x, y and z."""


def solved_path(points: Table, times: Table) -> Table:
    """Return the minimum-snap path as a table with a row per segment, columns as COEFFICIENTS says.

    ``points``: rows of x, y, z (m), yaw (rad); ``times``: duration of each segment in s, > 0.
    """
    count = len(points)
    matrix, right = np.zeros((3 * count, 3 * count)), np.zeros((3 * count, 3))
    for segment, h in enumerate(times):
        own = slice(3 * segment, 3 * segment + 6)
        powers = np.tile((h, h * h, h * h * h), 2)
        matrix[own, own] += np.outer(powers, powers) * COST / h**7
        right[own] += np.outer(powers * RISE, points[segment + 1, :3] - points[segment, :3]) / h**7
    knots = np.zeros((count, 3, 3))  # v, a and jerk of each waypoint, by axis
    knots[1:-1] = np.linalg.solve(matrix[3:-3, 3:-3], right[3:-3]).reshape(-1, 3, 3)
    columns: list[Any] = [np.concatenate(([0.0], np.cumsum(times)[:-1])), times, points[:-1, 3], points[1:, 3]]
    p: Any
    durations: Any = times
    for p, (v, a, jerk) in zip(points[:, :3].T, knots.transpose(2, 1, 0), strict=True):
        begin = AxisPoint(p[:-1], v[:-1], a[:-1], jerk[:-1], 0.0)
        columns += septic(begin, AxisPoint(p[1:], v[1:], a[1:], jerk[1:], 0.0), durations)
    return np.column_stack(columns)


def axis_at(path: Table, segment: int, axis: int, since: float) -> AxisPoint:
    """Return one axis of a segment and its derivatives at ``since`` s after its begin."""
    first = FIRST_COEFFICIENT + COEFFICIENTS * axis
    c = Polynomial(
        float(path[segment, first]),
        float(path[segment, first + 1]),
        float(path[segment, first + 2]),
        float(path[segment, first + 3]),
        float(path[segment, first + 4]),
        float(path[segment, first + 5]),
        float(path[segment, first + 6]),
        float(path[segment, first + 7]),
    )
    return evaluate(c, float(path[segment, 1]), since)


def axes_of(path: Table, samples: int) -> tuple[AxisPoint, ...]:
    """Return x, y and z at ``samples`` + 1 instants of each segment, its ends included: arrays (segments, instants)."""
    duration: Any = path[:, 1, None]
    time = duration * np.linspace(0.0, 1.0, samples + 1)
    columns = path[:, FIRST_COEFFICIENT:].T.reshape(3, COEFFICIENTS, -1, 1)
    return tuple(evaluate(Polynomial(*axis), duration, time) for axis in columns)


SAMPLES = 16
ROUNDS = 12
DAMPING = 0.5
FINE_SAMPLES = 48
SLOWER = 1.004
ACCEPTED = 0.997
"""Factors for what lies between two samples: how much slower than they ask for, and how close to that is accepted."""

SLOWING_TRIES = 100

MIN_THRUST = 0.2  # least thrust of a path over the weight: a vehicle that falls freely cannot turn its thrust


class PathLimits(NamedTuple):
    """Speed m/s, specific thrust at most and at least m/s^2, tangent of tilt, body rate rad/s, gravity m/s^2."""

    speed: float
    max_thrust: float
    min_thrust: float
    tilt_tangent: float
    body_rate: float
    gravity: float


def path_limits(name: str, parameters: Any, vehicle: Vehicle) -> PathLimits:
    """Return the limits that trajectory ``name`` sets by its parameters speed, thrust, tilt and body_rate.

    Raises ValueError if the thrust limit is below the weight.
    """
    gravity = vehicle.gravity
    specific_thrust = parameters.thrust * max_thrust(vehicle) / vehicle.mass
    if specific_thrust <= 1.01 * gravity:
        raise ValueError(f"{name}.thrust: the thrust limit of the path does not carry the vehicle's weight")
    return PathLimits(
        parameters.speed,
        specific_thrust,
        MIN_THRUST * gravity,
        math.tan(parameters.tilt),
        parameters.body_rate,
        gravity,
    )


def allocated_path(points: Table, limits: PathLimits, turns: MotionLimits) -> Table:
    """Return the fastest path found through ``points`` (rows x, y, z, yaw) within ``limits`` and those of ``turns``.

    Raises ValueError if slowing down does not bring it within the limits.
    """
    turning = np.array([turn_duration(turns, angle) for angle in np.diff(points[:, 3]).tolist()])
    times = first_times(points, limits, turning)
    best, shortest = times, math.inf
    for _ in range(ROUNDS):
        factors = segment_factors(solved_path(points, times), limits, turning, SAMPLES)
        worst = float(factors.max())
        if worst * times.sum() < shortest:
            best, shortest = worst * times, worst * times.sum()
        times = times * (1.0 + DAMPING * (factors / worst - 1.0)) * worst
    return slowed_path(points, best, limits, turning)


def slowed_path(points: Table, times: Table, limits: PathLimits, turning: Table) -> Table:
    """Return the path with ``times`` scaled by one factor so that it keeps the limits."""
    for _ in range(SLOWING_TRIES + 1):
        path = solved_path(points, times)
        worst = float(segment_factors(path, limits, turning, FINE_SAMPLES).max())
        if worst <= ACCEPTED:
            return path
        times = SLOWER * worst * times
    raise ValueError("waypoints: no time allocation keeps the limits of speed, thrust, tilt, body rate and yaw")


def first_times(points: Table, limits: PathLimits, turning: Table) -> Table:
    """Return times in s to begin with: each segment as if flown from rest to rest with half the thrust to spare."""
    room = 0.5 * (limits.max_thrust - limits.gravity)
    distance = np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)
    return np.maximum(turning, distance / limits.speed + np.sqrt(distance / room))


def segment_factors(path: Table, limits: PathLimits, turning: Table, samples: int) -> Table:
    """Return by which factor each segment has to be slower to keep the limits; below 1: it may be faster.

    ``turning``: shortest time in s for the yaw turn of each segment.
    """
    x, y, z = axes_of(path, samples)
    return np.maximum(sample_factors(x, y, z, limits).max(axis=1), turning / path[:, 1])


def sample_factors(x: AxisPoint, y: AxisPoint, z: AxisPoint, limits: PathLimits) -> Table:
    """Return by which factor a path has to be slower to keep the limits at its points, the thrust direction kept."""
    g, up, v = limits.gravity, np.asarray(z.a), np.asarray([x.v, y.v, z.v])
    across2 = np.asarray(x.a * x.a + y.a * y.a)
    whole2 = across2 + up * up
    with np.errstate(divide="ignore", invalid="ignore"):
        spare = g * g * up * up + whole2 * (limits.max_thrust * limits.max_thrust - g * g)
        by_thrust = np.where(whole2 > 0.0, np.sqrt(whole2 / (np.sqrt(spare) - g * up)), 0.0)
    by_fall = np.sqrt(np.maximum(-up, 0.0) / (g - limits.min_thrust))
    tilting = np.maximum(np.sqrt(across2) - limits.tilt_tangent * up, 0.0)
    by_tilt = np.sqrt(tilting / (limits.tilt_tangent * g))
    by_rate = np.sqrt(np.sqrt(body_rates(x, y, z, g) / limits.body_rate))
    by_speed = np.sqrt((v * v).sum(axis=0)) / limits.speed
    needed: Table = np.maximum.reduce([by_speed, by_thrust, by_fall, by_tilt, by_rate])
    return needed


def body_rates(x: AxisPoint, y: AxisPoint, z: AxisPoint, gravity: float) -> Table:
    """Return the rate in rad/s at which the direction of the specific thrust (a + g) turns: |f x jerk| / f^2."""
    force = np.stack([x.a, y.a, z.a + gravity])
    across = np.cross(force, np.stack([x.jerk, y.jerk, z.jerk]), axis=0)
    thrust2 = (force * force).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(thrust2 > 0.0, np.sqrt((across * across).sum(axis=0)) / thrust2, math.inf)
