"""Figures as Plotly specifications: plain maps that plotly.js draws, numbers packed as base64 arrays."""

import base64
from typing import Any

import numpy as np

from quad_flight_log.report.figures import POINTS, REFERENCE, Band, Figure, Floats, Line, Panel, bounds, height, thin

PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#7f7f7f")  # Okabe and Ito's
REFERENCE_COLOUR = "#222222"
_PANEL_HEIGHT, _DOTS_HEIGHT, _SPATIAL_HEIGHT, _MARGIN = 190, 150, 560, 85
WANTED_OPACITY, WANTED_WIDTH = 0.3, 3.0  # of lines that were wanted; the width is over that of a flown line
_LETTER, _ROW = 0.028, 13  # width of a letter as a share of a figure on a phone, pixels between two rows of labels
_GAP = 18  # pixels between two panels
_GRID = {"gridcolor": "#e3e6ea", "zerolinecolor": "#b9c0c8", "linecolor": "#8a939c", "showline": True}


def colours(runs: list[str]) -> dict[str, str]:
    """Return {run: colour}; the reference is nearly black."""
    flown = [run for run in runs if run != REFERENCE]
    found = {run: PALETTE[index % len(PALETTE)] for index, run in enumerate(flown)}
    return {**found, REFERENCE: REFERENCE_COLOUR}


def specification(figure: Figure, colour: dict[str, str], points: int = POINTS) -> dict[str, Any]:
    """Return {"data": [...], "layout": {...}} for Plotly; every trace says in ``meta.run`` what toggles it."""
    data: list[dict[str, Any]] = []
    named: set[str] = set()
    for index, panel in enumerate(figure.panels):
        for line in sorted(panel.lines, key=lambda each: not each.dashed):  # what was wanted lies under what was flown
            trace = _trace(thin(line, points), panel, index, colour[line.run], figure.spatial)
            trace["showlegend"] = line.label not in named
            named.add(line.label)
            data.append(trace)
    layout: dict[str, Any] = {
        "font": {"family": "system-ui, sans-serif", "size": 12},
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "margin": {"l": 85, "r": 20, "t": 40, "b": 45},
        "legend": {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom"},
        "hovermode": "x" if figure.over_time else "closest",
        "uirevision": figure.key,
    }
    if figure.bands and figure.over_time:
        layout["shapes"] = [_shade(band) for band in figure.bands]
        layout["annotations"] = _notes(figure)
    layout.update(_scene(figure.panels[0]) if figure.spatial else _axes(figure))
    return {"data": data, "layout": layout}


def _shade(band: Band) -> dict[str, Any]:
    across = {"xref": "x", "yref": "paper", "x0": band.begin, "x1": band.end, "y0": 0, "y1": 1}
    return {
        "type": "rect",
        **across,
        "fillcolor": band.colour,
        "opacity": band.opacity,
        "line": {"width": 0},
        "layer": "below",
    }


def _notes(figure: Figure) -> list[dict[str, Any]]:
    """Return the labels of the bands, each in the first row in which none before it reaches that far."""
    low, high = figure.span or (min(b.begin for b in figure.bands), max(b.end for b in figure.bands))
    reach: list[float] = []  # of each row, up to where its labels go
    notes = []
    for band in sorted(figure.bands, key=lambda each: each.begin):
        begin = max(band.begin, low)
        row = next((row for row, end in enumerate(reach) if end <= begin), len(reach))
        reach[row:] = [begin + _LETTER * (len(band.label) + 1) * (high - low), *reach[row + 1 :]]
        place = {"xref": "x", "yref": "paper", "x": band.begin, "y": 1, "xanchor": "left", "yanchor": "top"}
        font = {"size": 11, "color": band.colour}
        notes.append({**place, "yshift": -_ROW * row, "text": band.label, "showarrow": False, "font": font})
    return notes


def packed(column: Floats) -> dict[str, str]:
    """Return a column as the base64 array that plotly.js decodes; single precision is finer than any screen."""
    largest = np.finfo(np.float32).max
    values = np.clip(column, -largest, largest).astype("<f4")
    return {"dtype": "f4", "bdata": base64.b64encode(values.tobytes()).decode("ascii")}


def _trace(line: Line, panel: Panel, index: int, colour: str, spatial: bool) -> dict[str, Any]:
    # what was wanted is broad and pale, so that it is seen on both sides of what was flown
    width = (12 if spatial else 6) if line.dashed else (4 if spatial else 1.6)
    style: dict[str, Any] = {"color": colour, "width": width}
    trace: dict[str, Any] = {
        "type": "scatter3d" if spatial else "scatter",
        "mode": "markers" if line.dots else "lines",
        "name": line.label,
        "legendgroup": line.label,
        "meta": {"run": line.run},
        "line": style,
    }
    if line.dashed:
        trace.update(opacity=WANTED_OPACITY, legendrank=1001)  # drawn first, named last
    for axis, column in zip("xyz", line.columns, strict=False):
        trace[axis] = packed(column)
    if spatial:
        trace["hovertemplate"] = "%{x:.3f}, %{y:.3f}, %{z:.3f} m"
        return trace
    if line.dots:
        trace["marker"] = {"color": colour, "size": 6, "opacity": 0.55}
    if panel.steps:
        style["shape"] = "hv"
    trace["yaxis"] = "y" if index == 0 else f"y{index + 1}"
    trace["hovertemplate"] = "%{y:.5g}"
    return trace


def _scene(panel: Panel) -> dict[str, Any]:
    spans = bounds(panel)
    widths = np.array([high - low for low, high in spans])
    ratio = widths / np.cbrt(widths.prod())
    away = max(1.5, float(ratio.max()))
    axes = {
        f"{axis}axis": {"title": {"text": f"{axis} [m]"}, "range": list(span), "nticks": 5}
        for axis, span in zip("xyz", spans, strict=True)
    }
    return {
        "height": _SPATIAL_HEIGHT,
        "scene": {
            **axes,
            "aspectmode": "manual",
            "aspectratio": dict(zip("xyz", ratio.tolist(), strict=True)),
            "camera": {"eye": {"x": away, "y": -away, "z": 0.45 * away}, "center": {"x": 0.0, "y": 0.0, "z": -0.12}},
        },
    }


def _axes(figure: Figure) -> dict[str, Any]:
    count = len(figure.panels)
    drawn = (_PANEL_HEIGHT if figure.over_time else _DOTS_HEIGHT) * count
    gap = _GAP / drawn
    share = (1.0 - gap * (count - 1)) / count
    found: dict[str, Any] = {"height": _MARGIN + drawn}
    for index, panel in enumerate(figure.panels):
        top = 1.0 - index * (share + gap)
        axis: dict[str, Any] = {
            "title": {"text": panel.y_label.replace("\n", "<br>"), "standoff": 8},
            "domain": [max(0.0, top - share), top],
            **_GRID,
        }
        if figure.span and (shown := height(panel, figure.span)):
            axis["range"] = list(shown)
        if panel.logarithmic:
            axis["type"] = "log"
        found["yaxis" if index == 0 else f"yaxis{index + 1}"] = axis
    bottom = "y" if count == 1 else f"y{count}"
    found["xaxis"] = {"title": {"text": figure.x_label}, "anchor": bottom, **_GRID}
    if figure.span:
        found["xaxis"]["range"] = list(figure.span)
    if figure.ticks:
        found["xaxis"].update(tickvals=list(range(len(figure.ticks))), ticktext=list(figure.ticks), zeroline=False)
    return found
