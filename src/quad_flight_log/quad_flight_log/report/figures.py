"""Figures as data, and the Plotly specifications that draw them: panels of lines over a common x axis, or in space."""

import base64
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.analysis.arrays import Floats

REFERENCE = "/reference"
"""The run of what was wanted: no folder, and so no flight, has this name."""
POINTS = 2000  # of one line; more cannot be told apart on a page
PALETTE = (
    "#1f83c8",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#e69f00",
    "#56b4e9",
    "#a9745b",
    "#808080",
)  # near Okabe and Ito's
REFERENCE_COLOUR = "#7f8994"  # seen on a white and on a dark page
_WANTED_OPACITY = 0.45
_PANEL, _DOTS, _SPATIAL, _MARGIN, _GAP = 190, 150, 560, 85, 18  # pixels of height
_LETTER, _ROW = 0.028, 13  # width of a letter as a share of a figure on a phone, pixels between two rows of labels
_GRID = {"gridcolor": "rgba(128,137,148,.25)", "zerolinecolor": "rgba(128,137,148,.6)"}
_SPACE_GRID = {"gridcolor": "#98a1ab", "zerolinecolor": "#98a1ab", "linecolor": "#98a1ab"}
_AXIS = {**_GRID, "linecolor": "#8a939c", "showline": True, "exponentformat": "power"}
_CLEAR = "rgba(0,0,0,0)"  # the page's own background, light or dark


class Line(NamedTuple):
    """One line, or ``dots``. ``run``: what it is shown and hidden with; ``columns``: x, y (and z) of shape (n,).

    ``dashed``: what was wanted or true, drawn broad and pale under what was flown or estimated.
    """

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
    opacity: float = 0.14
    colour: str = "#d55e00"


class Figure(NamedTuple):
    """Panels over one another with a common x axis. ``key`` is unique in a report and a file name.

    ``spatial``: the one panel holds paths (x, y, z) in m. ``span``: part of the x axis shown first; None for all.
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
        return self.x_label == "t [s]" and not self.spatial and not self.ticks


def thin(line: Line, limit: int = POINTS) -> Line:
    """Return ``line`` with about ``limit`` points: both ends, and every extreme in each of equally long stretches.

    Points that are not finite are left out.
    """
    finite = np.logical_and.reduce([np.isfinite(column) for column in line.columns])
    columns = [column[finite] for column in line.columns]
    if len(columns[0]) > limit and not line.dots:
        turning = columns if len(columns) == 3 else columns[1:]
        edges = np.linspace(0, len(columns[0]), max(1, limit // (2 * len(turning))) + 1).astype(int)
        kept = {0, len(columns[0]) - 1}
        for column in turning:
            for low, high in pairwise(edges):
                part = column[low:high]
                kept |= {int(low + part.argmin()), int(low + part.argmax())}
        columns = [column[sorted(kept)] for column in columns]
    return line._replace(columns=tuple(columns))


def runs_of(figures: list[Figure]) -> list[str]:
    """Return the names of all runs in order of appearance, the reference last."""
    names = dict.fromkeys(line.run for figure in figures for panel in figure.panels for line in panel.lines)
    return [name for name in names if name != REFERENCE] + ([REFERENCE] if REFERENCE in names else [])


def colours(runs: list[str]) -> dict[str, str]:
    """Return {run: colour}; the reference is grey."""
    flown = [run for run in runs if run != REFERENCE]
    return {**{run: PALETTE[at % len(PALETTE)] for at, run in enumerate(flown)}, REFERENCE: REFERENCE_COLOUR}


def specification(figure: Figure, colour: dict[str, str]) -> dict[str, Any]:
    """Return {"data": [...], "layout": {...}} for Plotly; every trace says in ``meta.run`` what toggles it."""
    data: list[dict[str, Any]] = []
    named: set[str] = set()
    for index, panel in enumerate(figure.panels):
        for line in sorted(panel.lines, key=lambda each: not each.dashed):
            trace = _trace(thin(line), panel, index, colour[line.run], figure.spatial)
            data.append({**trace, "showlegend": line.label not in named})
            named.add(line.label)
    layout: dict[str, Any] = {
        "font": {"family": "system-ui, sans-serif", "size": 12},
        "paper_bgcolor": _CLEAR,
        "plot_bgcolor": _CLEAR,
        "margin": {"l": 85, "r": 20, "t": 40, "b": 45},
        "legend": {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom", "bgcolor": _CLEAR},
        "modebar": {"bgcolor": _CLEAR},
        "hovermode": "x" if figure.over_time else "closest",
        **(_scene(figure.panels[0]) if figure.spatial else _axes(figure)),
    }
    if figure.bands and figure.over_time:
        layout["shapes"] = [_shade(band) for band in figure.bands]
        layout["annotations"] = _labels(figure)
    return {"data": data, "layout": layout}


def _trace(line: Line, panel: Panel, index: int, colour: str, spatial: bool) -> dict[str, Any]:
    style: dict[str, Any] = {
        "color": colour,
        "width": (12 if spatial else 6) if line.dashed else (4 if spatial else 1.6),
    }
    trace: dict[str, Any] = {
        "type": "scatter3d" if spatial else "scatter",
        "mode": "markers" if line.dots else "lines",
        "name": line.label,
        "legendgroup": line.label,
        "meta": {"run": line.run},
        "line": style,
        "hovertemplate": "%{x:.3f}, %{y:.3f}, %{z:.3f} m" if spatial else "%{y:.5g}",
        **{axis: packed(column) for axis, column in zip("xyz", line.columns, strict=False)},
    }
    if line.dashed:
        trace.update(opacity=_WANTED_OPACITY, legendrank=1001)  # drawn first, named last
    if not spatial:
        trace["yaxis"] = "y" if index == 0 else f"y{index + 1}"
    if line.dots:
        trace["marker"] = {"color": colour, "size": 6, "opacity": 0.55}
    if panel.steps:
        style["shape"] = "hv"
    return trace


def packed(column: Floats) -> dict[str, str]:
    """Return a column as the base64 array that plotly.js decodes; single precision is finer than any screen."""
    largest = np.finfo(np.float32).max
    values = np.clip(column, -largest, largest).astype("<f4")
    return {"dtype": "f4", "bdata": base64.b64encode(values.tobytes()).decode("ascii")}


def _shade(band: Band) -> dict[str, Any]:
    place = {"type": "rect", "xref": "x", "yref": "paper", "x0": band.begin, "x1": band.end, "y0": 0, "y1": 1}
    return {**place, "fillcolor": band.colour, "opacity": band.opacity, "line": {"width": 0}, "layer": "below"}


def _labels(figure: Figure) -> list[dict[str, Any]]:
    """Return the labels of the bands, each in the first row in which none before it reaches that far."""
    low, high = figure.span or (min(b.begin for b in figure.bands), max(b.end for b in figure.bands))
    reach: list[float] = []  # of each row, up to where its labels go
    labels = []
    for band in sorted(figure.bands, key=lambda each: each.begin):
        begin = max(band.begin, low)
        row = next((row for row, end in enumerate(reach) if end <= begin), len(reach))
        reach[row:] = [begin + _LETTER * (len(band.label) + 1) * (high - low), *reach[row + 1 :]]
        place = {"xref": "x", "yref": "paper", "x": band.begin, "y": 1, "xanchor": "left", "yanchor": "top"}
        font = {"size": 11, "color": band.colour}
        labels.append({**place, "yshift": -_ROW * row, "text": band.label, "showarrow": False, "font": font})
    return labels


def _bounds(panel: Panel) -> NDArray[np.float64]:
    """Return low and high (3, 2) of x, y and z that hold all paths, none narrower than a third of the widest."""
    paths = [np.stack(thin(line, len(line.columns[0])).columns) for line in panel.lines]
    points = np.concatenate([np.zeros((3, 0)), *paths], axis=1)
    if points.shape[1] == 0:
        return np.array([[0.0, 1.0]] * 3)
    low, high = points.min(axis=1), points.max(axis=1)
    half = 0.5 * np.maximum(1.2 * (high - low), max(float((high - low).max()), 1e-3) / 3.0)
    return np.stack([0.5 * (low + high) - half, 0.5 * (low + high) + half], axis=1)


def _ticks(low: float, high: float) -> list[float]:
    """Return up to six round numbers away from the ends of a range: there the numbers of two axes would collide."""
    tenth = 10.0 ** np.floor(np.log10((high - low) / 2.0))
    step = next(step for step in (tenth, 2.0 * tenth, 5.0 * tenth, 10.0 * tenth) if (high - low) / step <= 6.0)
    room = 0.07 * (high - low)
    return [float(step * at) for at in range(int(np.ceil((low + room) / step)), int((high - room) // step) + 1)]


def _scene(panel: Panel) -> dict[str, Any]:
    spans = _bounds(panel)
    widths = spans[:, 1] - spans[:, 0]
    ratio = widths / np.cbrt(widths.prod())
    away = 1.1 * max(1.8, float(ratio.max()))
    axes = {
        f"{axis}axis": {"title": {"text": f"{axis} [m]"}, "range": span, "tickvals": _ticks(*span), **_SPACE_GRID}
        for axis, span in zip("xyz", spans.tolist(), strict=True)
    }
    shape = {"aspectmode": "manual", "aspectratio": dict(zip("xyz", ratio.tolist(), strict=True))}
    eye = {"x": away, "y": -away, "z": 0.45 * away}
    return {
        "height": _SPATIAL,
        "scene": {**axes, **shape, "camera": {"eye": eye, "center": {"x": 0.0, "y": 0.0, "z": -0.12}}},
    }


def _axes(figure: Figure) -> dict[str, Any]:
    count = len(figure.panels)
    drawn = (_DOTS if figure.ticks else _PANEL) * count
    gap = _GAP / drawn
    share = (1.0 - gap * (count - 1)) / count
    found: dict[str, Any] = {"height": _MARGIN + drawn}
    for index, panel in enumerate(figure.panels):
        top = 1.0 - index * (share + gap)
        title = {"text": panel.y_label.replace("\n", "<br>"), "standoff": 8}
        axis: dict[str, Any] = {"title": title, "domain": [max(0.0, top - share), top], **_AXIS}
        if figure.span and (shown := height(panel, figure.span)):
            axis["range"] = list(shown)
        if panel.logarithmic:
            axis["type"] = "log"
        found["yaxis" if index == 0 else f"yaxis{index + 1}"] = axis
    found["xaxis"] = {"title": {"text": figure.x_label}, "anchor": "y" if count == 1 else f"y{count}", **_AXIS}
    if figure.span:
        found["xaxis"]["range"] = list(figure.span)
    if figure.ticks:
        found["xaxis"].update(tickvals=list(range(len(figure.ticks))), ticktext=list(figure.ticks), zeroline=False)
    return found


def height(panel: Panel, span: tuple[float, float]) -> tuple[float, float] | None:
    """Return the y range that shows all of a panel's lines inside ``span``, with a margin; None without lines."""
    columns = [line.columns[:2] for line in panel.lines]
    inside = np.concatenate([np.zeros(0), *(y[(x >= span[0]) & (x <= span[1]) & np.isfinite(y)] for x, y in columns)])
    if not len(inside):
        return None
    low, high = float(inside.min()), float(inside.max())
    room = 0.06 * (high - low) or 0.1
    return low - room, high + room
