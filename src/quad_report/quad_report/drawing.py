"""Figures for a paper: what a report shows, drawn by matplotlib as PDF, SVG or PNG of an exact width."""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from quad_flight_log.errors import FlightLogError, needed
from quad_report.figures import REFERENCE_COLOUR, Figure, colours, height, runs_of, thin
from quad_report.flight_figures import Playback, Run, inside_figures, paper_figures, playback

KINDS = (".pdf", ".svg", ".png")
_INCH = 25.4  # mm
_LETTER, _HANDLE, _ROW = (
    1.5,
    9.0,
    4.0,
)  # mm: width of a letter, of what stands before a name in a legend, height of a row
_TICK = 24  # letters of a name below an axis in one line
_STYLE = {
    "font.size": 8.0,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "grid.color": "#d9dde2",
    "grid.linewidth": 0.5,
    "lines.linewidth": 0.9,
    "pdf.fonttype": 42,  # embedded TrueType: publishers refuse Type 3
    "svg.hashsalt": "quad",
    "savefig.dpi": 300,
}


def figures_by_name(runs: Sequence[Run]) -> dict[str, Figure | Playback]:
    """Return {name: figure} of runs of one trajectory: path, x to yaw, error, effort, spectrum, and the laws' own."""
    every: list[Figure | Playback] = [*playback(runs), *paper_figures(runs), *inside_figures(runs)]
    prefix = f"{runs[0].trajectory or 'flight'}-"
    return {each.key.partition(prefix)[2]: each for each in every}


def save(figure: Figure | Playback, path: Path, width: float, height_mm: float | None = None) -> None:
    """Draw a figure ``width`` mm wide into ``path``, whose ending says the format; FlightLogError for another one."""
    if path.suffix not in KINDS:
        raise FlightLogError(f"{path}: found {path.suffix!r}, expected {', '.join(KINDS)}")
    mpl, canvases = needed("matplotlib", "a figure"), needed("matplotlib.figure", "a figure")
    with mpl.rc_context(_STYLE):
        canvas = canvases.Figure(layout="constrained")
        handles, labels = _space(canvas, figure) if isinstance(figure, Playback) else _panels(canvas, figure)
        columns = max(1, min(4, int(width / (_LETTER * max(map(len, labels), default=0) + _HANDLE))))
        tall = height_mm or _height(figure, width, math.ceil(len(labels) / columns))
        canvas.set_size_inches(width / _INCH, tall / _INCH)
        if len(labels) > 1:
            canvas.legend(handles, labels, loc="outside upper center", ncols=columns, frameon=False)
        path.parent.mkdir(parents=True, exist_ok=True)
        dates = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {}}
        canvas.savefig(path, metadata=dates[path.suffix])


def _height(figure: Figure | Playback, width: float, rows: int) -> float:
    """Return the height in mm of a figure with so many rows of names above it; names below its axis add theirs."""
    if isinstance(figure, Playback):
        return 0.8 * width
    below = max((len(line) for tick in _wrapped(figure.ticks) for line in tick.splitlines()), default=0)
    panels: float = len(figure.panels) ** 0.8
    return 10.0 + 0.38 * width * panels + _ROW * (rows - 1) + _LETTER * below


def _wrapped(ticks: Sequence[str]) -> list[str]:
    """Return names below an axis in lines that are short enough to stand there at an angle."""
    return ["\n".join(textwrap.wrap(tick, _TICK)) for tick in ticks]


def _panels(canvas: Any, figure: Figure) -> tuple[list[Any], list[str]]:
    colour, named = colours(runs_of([figure])), dict[str, Any]()
    axes = canvas.subplots(len(figure.panels), 1, sharex=True, squeeze=False)[:, 0]
    for ax, panel in zip(axes, figure.panels, strict=True):
        for line in sorted(panel.lines, key=lambda each: not each.dashed):
            look: dict[str, Any] = {"linewidth": 2.4, "alpha": 0.45} if line.dashed else {}
            if line.dots:
                look = {"linestyle": "", "marker": "o", "markersize": 3.0}
            (drawn,) = ax.plot(*thin(line).columns, color=colour[line.run], **look)
            named.setdefault(line.label, drawn)
        ax.set_ylabel(panel.y_label)
        positive = any((line.columns[1] > 0.0).any() for line in panel.lines)
        ax.set_yscale("log" if panel.logarithmic and positive else "linear")
        if figure.span and (shown := height(panel, figure.span)):
            ax.set(xlim=figure.span, ylim=shown)
    axes[-1].set(xlabel=figure.x_label, xscale="log" if figure.logarithmic else "linear")
    if figure.ticks:
        axes[-1].set_xticks(range(len(figure.ticks)), _wrapped(figure.ticks), rotation=45, ha="right")
        return [], []  # the axis names what is drawn
    return list(named.values()), list(named)


def _space(canvas: Any, figure: Playback) -> tuple[list[Any], list[str]]:
    from matplotlib.ticker import MaxNLocator

    ax, colour = canvas.add_subplot(projection="3d"), colours([run.name for run in figure.runs])
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for run in figure.runs:
        for topic in ("reference", "truth") if run is figure.runs[0] and run.has("reference") else ("truth",):
            path = run.tables[topic]["p_w"]
            style = {"color": REFERENCE_COLOUR, "linewidth": 2.4, "alpha": 0.5, "label": "reference"}
            ax.plot(*path.T, **(style if topic == "reference" else {"color": colour[run.name], "label": run.name}))
            low, high = np.minimum(low, path.min(axis=0)), np.maximum(high, path.max(axis=0))
    ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    ax.set_box_aspect(np.maximum(high - low, 0.3 * float((high - low).max()) or 1.0), zoom=0.72)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    handles, labels = ax.get_legend_handles_labels()
    return handles, labels
