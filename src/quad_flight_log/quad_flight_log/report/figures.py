"""Figures as data: panels of lines that the interactive and the printed renderer both draw."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
REFERENCE = "reference"
_NARROWEST = 1.0 / 3.0
POINTS = 2000  # of one line; more cannot be told apart on a page


class Line(NamedTuple):
    """One line, or ``dots``. ``run``: what it is shown and hidden with; ``columns``: x, y (and z) of shape (n,)."""

    run: str
    label: str
    columns: tuple[Floats, ...]
    dashed: bool = False
    dots: bool = False


class Panel(NamedTuple):
    """One pair of axes; ``y_label`` names quantity and unit. Lines of three columns make it a spatial one."""

    y_label: str
    lines: tuple[Line, ...]
    steps: bool = False
    logarithmic: bool = False


class Band(NamedTuple):
    """A part of the x axis that is shaded in every panel, its label, how strongly (0 to 1), and its colour."""

    begin: float
    end: float
    label: str
    opacity: float = 0.12
    colour: str = "#d55e00"


class Figure(NamedTuple):
    """Panels over one another with a common x axis. ``key`` is unique in a report and a file name.

    ``spatial``: the panels hold paths (x, y, z) in m. ``span``: part of the x axis shown first; None for all.
    ``ticks``: names in place of the numbers 0, 1, ... on the x axis. ``bands``: what is shaded, only over time.
    """

    key: str
    title: str
    caption: str
    panels: tuple[Panel, ...]
    x_label: str = "t [s]"
    spatial: bool = False
    span: tuple[float, float] | None = None
    ticks: tuple[str, ...] = ()
    bands: tuple[Band, ...] = ()

    @property
    def over_time(self) -> bool:
        """Whether the x axis is time."""
        return not self.spatial and not self.ticks


class Table(NamedTuple):
    """A table of text: its title, the head and the rows. ``hints``: what each row means, shown on hover."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    hints: tuple[str, ...] = ()


def thinned(columns: tuple[Floats, ...], limit: int = POINTS) -> NDArray[np.intp]:
    """Return the indices of about ``limit`` points that keep both ends and every column's extremes in each bucket.

    Buckets hold equally many points; a column that never turns (time) asks for nothing that the ends do not give.
    """
    count = len(columns[0])
    if count <= limit:
        return np.arange(count)
    turning = [column for column in columns if not _monotonic(column)] or [columns[-1]]
    buckets = max(1, limit // (2 * len(turning)))
    starts = np.linspace(0, count, buckets + 1).astype(np.intp)
    chosen = [np.array([0, count - 1])]
    chosen += [pick(column, starts) for column in turning for pick in (_first_minimum, _first_maximum)]
    kept: NDArray[np.intp] = np.unique(np.concatenate(chosen)).astype(np.intp)
    return kept


def thin(line: Line, limit: int = POINTS) -> Line:
    """Return ``line`` with the points of ``thinned``; points that are not finite are gaps and stay out of it."""
    finite = np.logical_and.reduce([np.isfinite(column) for column in line.columns])
    columns = tuple(column[finite] for column in line.columns)
    if len(columns[0]) == 0:
        return line._replace(columns=columns)
    kept = thinned(columns, limit)
    return line._replace(columns=tuple(column[kept] for column in columns))


def height(panel: Panel, span: tuple[float, float]) -> tuple[float, float] | None:
    """Return the y range that shows all of a panel's lines inside ``span``, with a margin; None without lines."""
    inside = [
        y[(x >= span[0]) & (x <= span[1]) & np.isfinite(y)] for x, y in (line.columns[:2] for line in panel.lines)
    ]
    shown = [values for values in inside if len(values)]
    if not shown:
        return None
    low, high = min(float(values.min()) for values in shown), max(float(values.max()) for values in shown)
    room = 0.06 * (high - low) or 0.1
    return low - room, high + room


def bounds(panel: Panel) -> list[tuple[float, float]]:
    """Return the ranges of x, y and z that hold all paths of a panel, none narrower than a third of the widest."""
    lines = [line for line in panel.lines if len(line.columns[0])]
    if not lines:
        return [(0.0, 1.0)] * 3
    ends = [
        (
            min(float(np.nanmin(line.columns[axis])) for line in lines),
            max(float(np.nanmax(line.columns[axis])) for line in lines),
        )
        for axis in range(3)
    ]
    widest = max(*(high - low for low, high in ends), 1e-3)
    found = []
    for low, high in ends:
        half, middle = 0.5 * max(1.06 * (high - low), _NARROWEST * widest), 0.5 * (low + high)
        found.append((middle - half, middle + half))
    return found


def runs_of(figures: list[Figure]) -> list[str]:
    """Return the names of all runs in order of appearance, the reference last."""
    names = dict.fromkeys(line.run for figure in figures for panel in figure.panels for line in panel.lines)
    return [name for name in names if name != REFERENCE] + ([REFERENCE] if REFERENCE in names else [])


def _monotonic(column: Floats) -> bool:
    change = np.diff(column)
    return bool((change >= 0.0).all() or (change <= 0.0).all())


def _first_minimum(column: Floats, starts: NDArray[np.intp]) -> NDArray[Any]:
    return np.array([low + int(column[low:high].argmin()) for low, high in pairwise(starts)])


def _first_maximum(column: Floats, starts: NDArray[np.intp]) -> NDArray[Any]:
    return np.array([low + int(column[low:high].argmax()) for low, high in pairwise(starts)])
