"""Minimum-snap paths: of all paths through the waypoints at given times, the one with the least integral of snap^2.

    min int |snap(t)|^2 dt,    p(t_i) = waypoint i,    v = a = jerk = 0 at both ends    (Mellinger and Kumar, ICRA 2011)

Between two waypoints it is a polynomial of degree 7; at each inner waypoint derivatives 1 to 6 are continuous. Unknown
are velocity, acceleration and jerk at the inner waypoints: the gradient of the cost by them is the jump of derivatives
6, 5 and 4, a symmetric, positive definite, banded system.
"""

import numpy as np
from numpy import zeros
from numpy.typing import NDArray

from quad_trajectory.polynomial import AxisPoint

Table = NDArray[np.float64]

BAND = 6
"""Width of the upper half of the band, diagonal included: two waypoints of three unknowns each."""

COST = (
    (1080.0, 225.0, 20.0, 1020.0, -195.0, 15.0),
    (225.0, 50.0, 5.0, 195.0, -35.0, 2.5),
    (20.0, 5.0, 2.0 / 3.0, 15.0, -2.5, 1.0 / 6.0),
    (1020.0, 195.0, 15.0, 1080.0, -225.0, 20.0),
    (-195.0, -35.0, -2.5, -225.0, 50.0, -5.0),
    (15.0, 2.5, 1.0 / 6.0, 20.0, -5.0, 2.0 / 3.0),
)
"""Second derivatives of the integral of snap^2 over a segment of 1 s by v, a, jerk at its begin and its end, / 48."""

RISE = (2100.0, 420.0, 35.0, 2100.0, -420.0, 35.0)
"""Minus the mixed second derivatives by those and by the rise of the segment, / 48."""

FIRST_COEFFICIENT = 4
COEFFICIENTS = 8
WIDTH = FIRST_COEFFICIENT + 3 * COEFFICIENTS
"""Columns of a path: begin s, duration s, yaw at begin and end rad, then c0 ... c7 (m) of x, y and z; u in 0 ... 1."""


def solved_path(points: Table, times: Table) -> Table:
    """Return the minimum-snap path as a table with a row per segment, columns as WIDTH says.

    ``points``: rows of x, y, z (m), yaw (rad); ``times``: duration of each segment in s, > 0.
    """
    inner = 3 * (len(points) - 2)
    band = zeros((inner + BAND, BAND))
    right = zeros((inner + BAND, 3))
    for segment in range(len(points) - 1):
        add_segment(band, right, points, segment, inner, float(times[segment]))
    solve(band, right, inner)
    path = zeros((len(points) - 1, WIDTH))
    begin = 0.0
    for segment in range(len(points) - 1):
        h = float(times[segment])
        path[segment, 0] = begin
        path[segment, 1] = h
        path[segment, 2] = points[segment, 3]
        path[segment, 3] = points[segment + 1, 3]
        begin += h
        for axis in range(3):
            p0, p1 = float(points[segment, axis]), float(points[segment + 1, axis])
            left, end = knot(right, 3 * (segment - 1), inner, axis), knot(right, 3 * segment, inner, axis)
            write_coefficients(path, segment, axis, AxisPoint(p0, left.v, left.a, left.jerk, 0.0), p1, end)
    return path


def knot(solution: Table, first: int, inner: int, axis: int) -> AxisPoint:
    """Return v, a and jerk at the waypoint whose unknowns begin at row ``first``; at rest at both ends of the path."""
    if first < 0 or first >= inner:
        return AxisPoint(0.0, 0.0, 0.0, 0.0, 0.0)
    v, a, jerk = float(solution[first, axis]), float(solution[first + 1, axis]), float(solution[first + 2, axis])
    return AxisPoint(0.0, v, a, jerk, 0.0)


def add_segment(band: Table, right: Table, points: Table, segment: int, inner: int, h: float) -> None:
    """Add one segment of ``h`` s to the system: its part of the gradient of the integral of snap^2, / 48 h^7."""
    powers = (h, h * h, h * h * h)
    scale = 1.0 / (powers[2] * powers[2] * h)
    for row in range(6):
        unknown = 3 * (segment - 1) + row
        if 0 <= unknown < inner:
            weight = scale * powers[row % 3]
            for column in range(row, 6):
                if 3 * (segment - 1) + column < inner:
                    band[unknown, column - row] += weight * powers[column % 3] * COST[row][column]
            for axis in range(3):
                right[unknown, axis] += weight * RISE[row] * (points[segment + 1, axis] - points[segment, axis])


def solve(band: Table, right: Table, size: int) -> None:
    """Solve the banded, symmetric, positive definite system in place: ``right`` becomes the solution."""
    for i in range(size):
        pivot = float(band[i, 0])
        for k in range(1, BAND):
            factor = float(band[i, k]) / pivot
            if factor != 0.0:
                for j in range(k, BAND):
                    band[i + k, j - k] -= factor * band[i, j]
                for axis in range(3):
                    right[i + k, axis] -= factor * right[i, axis]
    for back in range(size):
        i = size - 1 - back
        for axis in range(3):
            total = float(right[i, axis])
            for k in range(1, BAND):
                total -= float(band[i, k]) * float(right[i + k, axis])
            right[i, axis] = total / float(band[i, 0])


def write_coefficients(path: Table, segment: int, axis: int, start: AxisPoint, p: float, end: AxisPoint) -> None:
    """Write c0 ... c7 of one axis of a segment from ``start`` to position ``p`` with v, a and jerk of ``end``."""
    h = float(path[segment, 1])
    v0, a0, j0 = h * start.v, h * h * start.a, h * h * h * start.jerk
    v1, a1, j1 = h * end.v, h * h * end.a, h * h * h * end.jerk
    rise = p - start.p
    first = FIRST_COEFFICIENT + COEFFICIENTS * axis
    path[segment, first] = start.p
    path[segment, first + 1] = v0
    path[segment, first + 2] = 0.5 * a0
    path[segment, first + 3] = j0 / 6.0
    path[segment, first + 4] = 35.0 * rise - 20.0 * v0 - 5.0 * a0 - j0 / 1.5 - 15.0 * v1 + 2.5 * a1 - j1 / 6.0
    path[segment, first + 5] = -84.0 * rise + 45.0 * v0 + 10.0 * a0 + j0 + 39.0 * v1 - 7.0 * a1 + 0.5 * j1
    path[segment, first + 6] = 70.0 * rise - 36.0 * v0 - 7.5 * a0 - j0 / 1.5 - 34.0 * v1 + 6.5 * a1 - 0.5 * j1
    path[segment, first + 7] = -20.0 * rise + 10.0 * v0 + 2.0 * a0 + j0 / 6.0 + 10.0 * v1 - 2.0 * a1 + j1 / 6.0


def axis_at(path: Table, segment: int, axis: int, u: float) -> AxisPoint:
    """Return one axis of a segment and its derivatives at ``u`` (0 ... 1) of its duration."""
    first = FIRST_COEFFICIENT + COEFFICIENTS * axis
    rate = 1.0 / float(path[segment, 1])
    rate2 = rate * rate
    c0, c1 = float(path[segment, first]), float(path[segment, first + 1])
    c2, c3 = float(path[segment, first + 2]), float(path[segment, first + 3])
    c4, c5 = float(path[segment, first + 4]), float(path[segment, first + 5])
    c6, c7 = float(path[segment, first + 6]), float(path[segment, first + 7])
    return AxisPoint(
        c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * (c5 + u * (c6 + u * c7)))))),
        rate * (c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * (5.0 * c5 + u * (6.0 * c6 + u * 7.0 * c7)))))),
        rate2 * (2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * (20.0 * c5 + u * (30.0 * c6 + u * 42.0 * c7))))),
        rate2 * rate * (6.0 * c3 + u * (24.0 * c4 + u * (60.0 * c5 + u * (120.0 * c6 + u * 210.0 * c7)))),
        rate2 * rate2 * (24.0 * c4 + u * (120.0 * c5 + u * (360.0 * c6 + u * 840.0 * c7))),
    )
