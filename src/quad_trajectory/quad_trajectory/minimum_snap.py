"""Minimum-snap paths: of all paths through the waypoints at given times, the one with the least integral of snap^2.

    min int |snap(t)|^2 dt,    p(t_i) = waypoint i,    v = a = jerk = 0 at both ends    (Mellinger and Kumar, ICRA 2011)

Between two waypoints it is a polynomial of degree 7; at each inner waypoint derivatives 1 to 6 are continuous. Unknown
are velocity, acceleration and jerk at the inner waypoints: the gradient of the cost by them is the jump of derivatives
6, 5 and 4, a symmetric, positive definite system.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

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
