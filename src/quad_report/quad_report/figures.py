"""Figures as data: panels of lines over a common x axis, and how Plotly draws them."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from quad_analysis.arrays import Floats
from quad_flight_log.errors import needed

REFERENCE = "/reference"  # the run of what was wanted: no folder, and so no flight, has this name
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
_PANEL, _DOTS, _MARGIN = 190, 150, 85  # pixels of height
_LETTER, _ROW = 0.028, 13  # width of a letter as a share of a figure on a phone, pixels between two rows of labels
_AXIS = {
    "gridcolor": "rgba(128,137,148,.25)",
    "zerolinecolor": "rgba(128,137,148,.6)",
    "linecolor": "#8a939c",
    "showline": True,
    "exponentformat": "power",
}
_CLEAR = "rgba(0,0,0,0)"  # the page's own background, light or dark


class Line(NamedTuple):
    """One line, or ``dots``. ``run``: what it is shown and hidden with; ``columns``: x and y of shape (n,).

    ``dashed``: what was wanted or true, drawn broad and pale under what was flown or estimated.
    """

    run: str
    label: str
    columns: tuple[Floats, Floats]
    dashed: bool = False
    dots: bool = False


class Panel(NamedTuple):
    """One pair of axes; ``y_label`` names quantity and unit."""

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

    ``span``: part of the x axis shown first; None for all. ``ticks``: names in place of the numbers 0, 1, ... on the
    x axis. ``bands``: what is shaded, only over time. ``logarithmic``: the x axis.
    """

    key: str
    title: str
    caption: str
    panels: tuple[Panel, ...]
    x_label: str = "t [s]"
    span: tuple[float, float] | None = None
    ticks: tuple[str, ...] = ()
    bands: tuple[Band, ...] = ()
    logarithmic: bool = False

    @property
    def over_time(self) -> bool:
        """Whether the x axis is time."""
        return self.x_label == "t [s]" and not self.ticks


def thin(line: Line, limit: int = POINTS) -> Line:
    """Return ``line`` with about ``limit`` points: both ends, and every extreme in each of equally long stretches.

    Points that are not finite are left out.
    """
    finite = np.isfinite(line.columns[0]) & np.isfinite(line.columns[1])
    x, y = (column[finite] for column in line.columns)
    if len(x) > limit and not line.dots:
        kept = {0, len(x) - 1}
        for low, high in pairwise(np.linspace(0, len(x), max(1, limit // 2) + 1).astype(int)):
            kept |= {int(low + y[low:high].argmin()), int(low + y[low:high].argmax())}
        x, y = x[sorted(kept)], y[sorted(kept)]
    return line._replace(columns=(x, y))


def runs_of(figures: list[Figure]) -> list[str]:
    """Return the names of all runs in order of appearance, the reference last."""
    names = dict.fromkeys(line.run for figure in figures for panel in figure.panels for line in panel.lines)
    return [name for name in names if name != REFERENCE] + ([REFERENCE] if REFERENCE in names else [])


def colours(runs: list[str]) -> dict[str, str]:
    """Return {run: colour}; the reference is grey."""
    flown = [run for run in runs if run != REFERENCE]
    return {**{run: PALETTE[at % len(PALETTE)] for at, run in enumerate(flown)}, REFERENCE: REFERENCE_COLOUR}


def drawn(figure: Figure, colour: dict[str, str]) -> Any:
    """Return the Plotly figure; every trace says in ``meta`` what toggles it. FlightLogError if there is no plotly."""
    plots, count = needed("plotly.subplots", "the report"), max(1, len(figure.panels))
    size = (_DOTS if figure.ticks else _PANEL) * count
    canvas = plots.make_subplots(rows=count, cols=1, shared_xaxes=True, vertical_spacing=18 / size if count > 1 else 0)
    named: set[str] = set()
    for row, panel in enumerate(figure.panels, start=1):
        for line in sorted(panel.lines, key=lambda each: not each.dashed):
            style = _style(line, colour[line.run], steps=panel.steps)
            x, y = (_single(column) for column in thin(line).columns)
            canvas.add_scatter(x=x, y=y, row=row, col=1, showlegend=line.label not in named, **style)
            named.add(line.label)
        low_high = height(panel, figure.span) if figure.span and figure.over_time else None
        axis = {"title": {"text": plain(panel.y_label), "standoff": 8}, "type": "log" if panel.logarithmic else None}
        canvas.update_yaxes(row=row, col=1, range=low_high, **axis, **_AXIS)
    canvas.update_xaxes(range=figure.span, type="log" if figure.logarithmic else None, **_AXIS)
    canvas.update_xaxes(title_text=plain(figure.x_label), row=count, col=1)
    if figure.ticks:
        names = [plain(each) for each in figure.ticks]
        canvas.update_xaxes(tickvals=list(range(len(names))), ticktext=names, zeroline=False)
    canvas.update_layout(
        template="none",
        height=_MARGIN + size,
        font={"family": "system-ui, sans-serif", "size": 12},
        paper_bgcolor=_CLEAR,
        plot_bgcolor=_CLEAR,
        margin={"l": 85, "r": 20, "t": 40, "b": 45},
        legend={"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom", "bgcolor": _CLEAR},
        modebar={"bgcolor": _CLEAR},
        hovermode="x" if figure.over_time else "closest",
    )
    if figure.over_time:
        _shade(canvas, figure)
    return canvas


def plain(text: str) -> str:
    """Return a text that Plotly shows as it stands: it reads some HTML, and draws links."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace("\n", "<br>")


def _single(column: Floats) -> Any:
    """Return a column in single precision, finer than any screen; what blew up lies at its edge."""
    largest = np.finfo(np.float32).max
    return np.clip(column, -largest, largest).astype("<f4")


def _style(line: Line, colour: str, *, steps: bool) -> dict[str, Any]:
    pale = {"opacity": 0.45, "legendrank": 1001} if line.dashed else {}  # drawn first, named last
    return {
        "mode": "markers" if line.dots else "lines",
        "name": plain(line.label),
        "legendgroup": line.label,
        "meta": {"run": line.run},
        "line": {"color": colour, "width": 6 if line.dashed else 1.6, "shape": "hv" if steps else None},
        "marker": {"color": colour, "size": 6, "opacity": 0.55} if line.dots else None,
        "hovertemplate": "%{y:.5g}",
        **pale,
    }


def _shade(canvas: Any, figure: Figure) -> None:
    """Shade the bands, each with its label in the first row in which none before it reaches that far."""
    low, high = figure.span or (
        min((b.begin for b in figure.bands), default=0.0),
        max((b.end for b in figure.bands), default=1.0),
    )
    reach: list[float] = []  # of each row, up to where its labels go
    for band in sorted(figure.bands, key=lambda each: each.begin):
        begin = max(band.begin, low)
        row = next((row for row, end in enumerate(reach) if end <= begin), len(reach))
        reach[row:] = [begin + _LETTER * (len(band.label) + 1) * (high - low), *reach[row + 1 :]]
        font = {"size": 11, "color": band.colour}
        place = {"x": band.begin, "y": 1, "yref": "paper", "xanchor": "left", "yanchor": "top", "yshift": -_ROW * row}
        canvas.add_vrect(band.begin, band.end, fillcolor=band.colour, opacity=band.opacity, line_width=0, layer="below")
        canvas.add_annotation(text=plain(band.label), showarrow=False, font=font, **place)


def height(panel: Panel, span: tuple[float, float]) -> tuple[float, float] | None:
    """Return the y range that shows all of a panel's lines inside ``span``, with a margin; None without lines."""
    columns = [line.columns for line in panel.lines]
    inside = np.concatenate([np.zeros(0), *(y[(x >= span[0]) & (x <= span[1]) & np.isfinite(y)] for x, y in columns)])
    if not len(inside):
        return None
    low, high = float(inside.min()), float(inside.max())
    room = 0.06 * (high - low) or 0.1
    return low - room, high + room
