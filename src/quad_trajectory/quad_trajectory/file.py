"""A trajectory from a planner's file: times, positions and, if wanted, yaw, velocities and accelerations.

    min sum w_i (|p(t_i) - p_i|^2 + s^2 |v(t_i) - v_i|^2 + s^4 |a(t_i) - a_i|^2) + s^8 int |p''''|^2 dt

w_i is half the time between the neighbours of t_i, s the ``smoothing``: what is slower than 1/s rad/s is kept, and the
derivatives of the rest do not reach the laws. p is of degree 7 between knots, yaw likewise; v_i and a_i count where
the file has them. The first position is reached by an approach; at the last one the vehicle stays, if the path ends at
rest.
"""

import csv
import math
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.geometry import norm
from quad_core.parameters import ParameterError, Real, Text
from quad_core.types import TrajectoryPoint, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory.approach import Approach, Entry, Start, plan_approach, sample_approach
from quad_trajectory.limits import MotionLimits
from quad_trajectory.minimum_snap import (
    COEFFICIENTS,
    FIRST_COEFFICIENT,
    Table,
    axes_of,
    axis_at,
    path_limits,
    sample_factors,
)
from quad_trajectory.polynomial import AxisPoint, at_rest, point, septic
from quad_trajectory.waypoints import FARTHEST

NEEDED = ("t", "x", "y", "z")
OPTIONAL = ("yaw", "vx", "vy", "vz", "ax", "ay", "az")
FEWEST_ROWS, MOST_ROWS = 4, 200_000  # fewer positions do not tell the path of least snap from others
KNOTS = 2.5  # time between two knots over the smoothing, where the file's own steps are shorter
SAMPLES = 8  # instants of each segment at which the limits are checked
REST = 0.1  # m/s, below which a path ends at rest


class Parameters(NamedTuple):
    """A file: how its first position is reached, how closely it is followed, and within which limits."""

    start: Entry = Start.APPROACH.value
    path: Annotated[str, Text("CSV or Parquet with columns t, x, y, z; optional: yaw, vx, vy, vz, ax, ay, az")] = ""
    smoothing: Annotated[float, Real("s", "time s; larger: smoother, farther from the positions", 0.001, 10.0)] = 0.04
    tolerance: Annotated[float, Real("m", "largest distance of the path from a position", 1e-6, 100.0)] = 0.05
    speed: Annotated[float, Real("m/s", "speed limit of the path", 0.01, 100.0)] = 10.0
    thrust: Annotated[float, Real("", "thrust limit of the path over the vehicle's largest thrust", 0.1, 1.0)] = 0.8
    tilt: Annotated[float, Real("rad", "tilt limit of the path", 0.01, 1.4)] = 1.0
    body_rate: Annotated[float, Real("rad/s", "largest turn rate of the thrust direction", 0.05, 30.0)] = 6.0
    stay: Annotated[float, Real("s", "flight time at the last position, where the path ends at rest", 0.0, 1e5)] = 2.0
    limits: MotionLimits = MotionLimits()


class Plan(NamedTuple):
    """The approach, the path (rows as in ``minimum_snap``, yaw as a fourth axis), duration and stay in s."""

    approach: Approach
    path: Table
    duration: float
    stay: float


class Rows(NamedTuple):
    """What the file says: its name, the line of each row, {column: values} with t from 0 on."""

    name: str
    lines: list[int]
    columns: dict[str, NDArray[np.float64]]


def check(parameters: Parameters) -> None:
    """Raise ParameterError naming the first line that is not understood."""
    read_rows(parameters.path)


def remarks(parameters: Parameters) -> list[str]:
    """Return what is flown: the file, its rows, how far the path is from them and from the lines between them."""
    rows = read_rows(parameters.path)
    path, miss = fitted(rows, parameters.smoothing)
    near = (
        f"path at most {1e3 * miss.max():.1f} mm from them, {off_lines(rows, path):.3f} m from the lines between them"
    )
    return [f"file {rows.name}: {len(rows.lines)} rows, {near}"]


def off_lines(rows: Rows, path: Table) -> float:
    """Return the largest distance in m of the path from the straight line between the two rows around it."""
    axes = axes_of(path[:, : FIRST_COEFFICIENT + 3 * COEFFICIENTS], SAMPLES)
    times = (path[:, :1] + path[:, 1:2] * np.arange(SAMPLES + 1) / SAMPLES).ravel()
    places = np.stack([np.ravel(axis.p) for axis in axes], axis=1)
    given = np.stack([rows.columns[name] for name in "xyz"], axis=1)
    at = np.clip(np.searchsorted(rows.columns["t"], times) - 1, 0, len(given) - 2)
    line = given[at + 1] - given[at]
    along_line = ((places - given[at]) * line).sum(axis=1) / np.maximum((line**2).sum(axis=1), 1e-12)
    off = places - given[at] - np.clip(along_line, 0.0, 1.0)[:, None] * line
    return float(np.linalg.norm(off, axis=1).max())


def plan(parameters: Parameters, vehicle: Vehicle, start: VehicleState) -> Plan:
    """Return the path, and how its first position is reached from ``start``.

    Raises ValueError naming the line at which the path leaves the limits or the positions.
    """
    rows = read_rows(parameters.path)
    path, miss = fitted(rows, parameters.smoothing)
    farthest = int(miss.argmax())
    if miss[farthest] > parameters.tolerance:
        found = f"{miss[farthest]:.3g} m away from this position, expected at most {parameters.tolerance:g} m"
        raise ValueError(f"{rows.name} line {rows.lines[farthest]}: the smooth path is {found} (file.smoothing)")
    refuse_beyond_limits(parameters, vehicle, rows, path)
    duration = float(path[-1, 0]) + float(path[-1, 1])
    approach = plan_approach(parameters.start, parameters.limits, vehicle.gravity, start, along(path, 0.0))
    stays = norm(along(path, duration).v_w) < REST
    return Plan(approach, path, duration, parameters.stay if stays else 0.0)


def refuse_beyond_limits(parameters: Parameters, vehicle: Vehicle, rows: Rows, path: Table) -> None:
    """Raise ValueError naming the line at which the path asks for most, if that is beyond the limits."""
    limits = path_limits("file", parameters, vehicle)
    x, y, z = axes_of(path[:, : FIRST_COEFFICIENT + 3 * COEFFICIENTS], SAMPLES)
    factors = sample_factors(x, y, z, limits)
    segment, sample = divmod(int(factors.argmax()), SAMPLES + 1)
    if factors[segment, sample] > 1.0:
        time = path[segment, 0] + path[segment, 1] * sample / SAMPLES
        line = rows.lines[int(np.abs(rows.columns["t"] - time).argmin())]
        needed = f"{factors[segment, sample]:.3g} times as slow to keep the limits of speed, thrust, tilt and body rate"
        raise ValueError(f"{rows.name} line {line}: the path has to be {needed} (file.speed, ...)")


def duration(parameters: Parameters, plan: Plan) -> float:  # noqa: ARG001
    """Return the end of the flight in s since take-off."""
    return plan.approach.duration + plan.duration + plan.stay


def sample(parameters: Parameters, plan: Plan, time: float) -> TrajectoryPoint:  # noqa: ARG001
    """Return the reference at ``time`` s since take-off; at rest at the last position from the end of the path on."""
    t = time - plan.approach.duration
    if t < 0.0:
        return sample_approach(plan.approach, time)
    if t >= plan.duration:
        return at_rest(along(plan.path, plan.duration), t)
    return along(plan.path, t)


def along(path: Table, t: float) -> TrajectoryPoint:
    """Return the reference at ``t`` s along the path, from 0 to its duration."""
    segment = min(int(t / float(path[0, 1])), len(path) - 1)
    since = t - float(path[segment, 0])
    return point(
        t,
        axis_at(path, segment, 0, since),
        axis_at(path, segment, 1, since),
        axis_at(path, segment, 2, since),
        axis_at(path, segment, 3, since),
    )


def read_rows(path: str) -> Rows:
    """Return the rows of a CSV or Parquet file.

    Raises ParameterError naming file and line, what was found and what was expected.
    """
    file = Path(path)
    expected = f"expected a CSV or Parquet file with columns {', '.join(NEEDED)} ({', '.join(OPTIONAL)})"
    try:
        table = parquet_rows(file) if file.suffix == ".parquet" else csv_rows(file)
        header, lines, cells = next(table), [], []
        names = [str(name).strip().lower() for name in header[1]]
        names = ["t" if name == "time" else name for name in names]
        if not set(NEEDED) <= set(names) or len(set(names)) < len(names):
            raise ParameterError(f"{file}: found columns {', '.join(names) or 'none'}, {expected}")
        for line, row in table:
            lines.append(line)
            cells.append(numbers(f"{file} line {line}", names, row))
            if len(cells) > MOST_ROWS:
                raise ParameterError(f"{file} line {line}: found more rows, expected at most {MOST_ROWS}")
    except (OSError, ValueError, StopIteration, csv.Error) as error:
        raise ParameterError(f"file.path: found {path!r} ({error or 'empty'}), {expected}") from error
    if len(cells) < FEWEST_ROWS:
        raise ParameterError(f"{file}: found {len(cells)} rows, expected at least {FEWEST_ROWS}")
    columns = dict(zip(names, np.array(cells).T, strict=True))
    late = np.flatnonzero(np.diff(columns["t"]) <= 0.0)
    if len(late):
        row = late[0] + 1
        raise ParameterError(f"{file} line {lines[row]}: found t = {columns['t'][row]:g} s, expected a later time")
    columns["t"] = columns["t"] - columns["t"][0]
    columns["yaw"] = np.unwrap(columns["yaw"]) if "yaw" in columns else np.zeros(len(cells))
    return Rows(str(file), lines, columns)


def csv_rows(file: Path) -> Any:
    """Yield (line, cells) of a CSV file, its header first; lines that are empty or begin with # are left out."""
    with file.open(newline="", encoding="utf-8-sig") as stream:
        reader = csv.reader(stream)
        yield from ((reader.line_num, row) for row in reader if row and not row[0].lstrip().startswith("#"))


def parquet_rows(file: Path) -> Any:
    """Yield (row, cells) of a Parquet file, its header first."""
    import pandas as pd

    table = pd.read_parquet(file)
    yield 0, list(table.columns)
    yield from enumerate(table.to_numpy().tolist(), 1)


def numbers(where: str, names: list[str], row: list[Any]) -> list[float]:
    """Return the cells of a row as numbers; raises ParameterError."""
    if len(row) != len(names):
        raise ParameterError(f"{where}: found {len(row)} values, expected {len(names)}")
    found = []
    for name, cell in zip(names, row, strict=True):
        try:
            value = float(cell)
        except (TypeError, ValueError):
            value = math.nan
        if (name in NEEDED or name in OPTIONAL) and not abs(value) <= (FARTHEST if name != "t" else 1e10):
            raise ParameterError(f"{where}: found {name} = {cell!r}, expected a number within {FARTHEST:g}")
        found.append(value)
    return found


def fitted(rows: Rows, smoothing: float) -> tuple[Table, NDArray[np.float64]]:
    """Return the path, columns as in ``minimum_snap`` and yaw as a fourth axis, and its distance in m from each row."""
    t = rows.columns["t"]
    spacing = max(KNOTS * smoothing, float(np.median(np.diff(t))))
    count = max(1, round(float(t[-1]) / spacing))
    h = float(t[-1]) / count
    segment = np.minimum((t / h).astype(int), count - 1)
    weights = np.gradient(t)
    derivatives = [basis(t / h - segment, order) / h**order for order in range(3)]
    durations: Any = np.full(count, h)
    columns: list[Any] = [h * np.arange(count), durations, np.zeros(count), np.zeros(count)]
    squares = []
    for axis in ("x", "y", "z", "yaw"):
        given = [rows.columns.get(name) for name in (axis, f"v{axis}", f"a{axis}")]
        knots = least_squares(derivatives, given, weights, segment, smoothing, h, count)
        p, v, a, jerk = (knots / np.array([1.0, h, h * h, h**3])).T
        begin = AxisPoint(p[:-1], v[:-1], a[:-1], jerk[:-1], 0.0)
        columns += septic(begin, AxisPoint(p[1:], v[1:], a[1:], jerk[1:], 0.0), durations)
        if axis != "yaw":
            both = np.hstack([knots[segment], knots[segment + 1]])
            squares.append(((both * derivatives[0]).sum(axis=1) - rows.columns[axis]) ** 2)
    return np.column_stack(columns), np.sqrt(sum(squares))


def basis(u: Any, order: int) -> NDArray[np.float64]:
    """Return the derivatives by u, of that order, of the eight polynomials on [0, 1]: an array (instants, 8).

    Each has one of p, v, a, jerk at the begin or at the end of 1 and the others of 0.
    """
    unit = np.eye(10)[:, [0, 1, 2, 3, 8, 4, 5, 6, 7, 9]]
    coefficients = np.array(septic(AxisPoint(*unit[:, :5].T), AxisPoint(*unit[:, 5:].T), 1.0))[:, :8]
    powers = [
        np.polynomial.Polynomial(column).deriv(order)(u) if order else np.polynomial.Polynomial(column)(u)
        for column in coefficients.T
    ]
    return np.stack(powers, axis=-1)


def least_squares(
    derivatives: list[Any], given: list[Any], weights: Any, segment: Any, smoothing: float, h: float, count: int
) -> NDArray[np.float64]:
    """Return p, h v, h^2 a and h^3 jerk at the knots, an array (count + 1, 4)."""
    nodes, share = np.polynomial.legendre.leggauss(4)
    snap = basis(0.5 * (nodes + 1.0), 4)
    energy = smoothing**8 / h**7 * (snap.T * (0.5 * share)) @ snap
    matrix, right = np.tile(energy, (count, 1, 1)), np.zeros((count, 8))
    for order, (rows, values) in enumerate(zip(derivatives, given, strict=True)):
        if values is not None:
            weighted = (weights * smoothing ** (2 * order))[:, None] * rows
            np.add.at(matrix, segment, weighted[:, :, None] * rows[:, None, :])
            np.add.at(right, segment, weighted * values[:, None])
    return block_solution(matrix, right)


def block_solution(matrix: Any, right: Any) -> NDArray[np.float64]:
    """Return the knots at which the quadratic forms of all segments, (n, 8, 8) and (n, 8), have their least sum."""
    count = len(matrix)
    diagonal, load = np.zeros((count + 1, 4, 4)), np.zeros((count + 1, 4))
    diagonal[:-1], load[:-1] = matrix[:, :4, :4], right[:, :4]
    diagonal[1:] += matrix[:, 4:, 4:]
    load[1:] += right[:, 4:]
    for k in range(count):
        factor = np.linalg.solve(diagonal[k], matrix[k, :4, 4:]).T
        diagonal[k + 1] -= factor @ matrix[k, :4, 4:]
        load[k + 1] -= factor @ load[k]
    knots = np.zeros((count + 1, 4))
    knots[-1] = np.linalg.solve(diagonal[-1], load[-1])
    for k in range(count - 1, -1, -1):
        knots[k] = np.linalg.solve(diagonal[k], load[k] - matrix[k, :4, 4:] @ knots[k + 1])
    return knots
