"""Figures as PNG, PDF or SVG files for a paper, drawn by Matplotlib without a display."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.figures import Figure, Panel, bounds, height, runs_of, thin
from quad_flight_log.report.interactive_figures import WANTED_OPACITY, WANTED_WIDTH, colours

FORMATS = ("png", "pdf", "svg")
_WIDTH = 5.4  # inch: one and a half columns
_PANEL_HEIGHT = 1.7
_SPATIAL_HEIGHT = 4.4
_MOST_TICKS = 6
_STYLE = {
    "font.size": 8.0,
    "axes.grid": True,
    "grid.linewidth": 0.4,
    "grid.color": "#d9dde2",
    "axes.linewidth": 0.6,
    "legend.frameon": False,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
}


def write_figures(
    figures: Sequence[Figure],
    directory: Path,
    formats: Sequence[str] = ("png", "pdf"),
    dpi: int = 200,
    done: Callable[[Path], None] | None = None,
) -> list[Path]:
    """Write one file per figure and format, named after the figure's key; returns the paths.

    Raises FlightLogError if the directory cannot be written to or Matplotlib is not installed.
    """
    colour = colours(runs_of(list(figures)))
    written = []
    for figure in figures:
        canvas = drawn(figure, colour)
        for form in formats:
            path = directory / f"{figure.key}.{form}"
            try:
                directory.mkdir(parents=True, exist_ok=True)
                canvas.savefig(path, dpi=dpi)
            except OSError as error:
                raise FlightLogError(f"{path}: {error.strerror or error}") from error
            written.append(path)
            if done:
                done(path)
    return written


def drawn(figure: Figure, colour: dict[str, str]) -> Any:
    """Return a Matplotlib figure."""
    try:
        import matplotlib as mpl
        from matplotlib.figure import Figure as Canvas
    except ImportError as error:
        raise FlightLogError("figures need Matplotlib: pip install -r requirements/extras.txt") from error
    with mpl.rc_context(_STYLE):
        if figure.spatial:
            canvas = Canvas(figsize=(_WIDTH, _SPATIAL_HEIGHT), layout="constrained")
            ax = canvas.add_subplot(projection="3d")
            draw_path(ax, figure.panels[0], colour)
            _legend(canvas, [ax])
        else:
            tall = 0.7 + _PANEL_HEIGHT * len(figure.panels)
            canvas = Canvas(figsize=(_WIDTH, tall), layout="constrained")
            axes = canvas.subplots(len(figure.panels), 1, sharex=True, squeeze=False)[:, 0]
            for ax, panel in zip(axes, figure.panels, strict=True):
                _draw_panel(ax, panel, colour)
                for band in figure.bands if figure.over_time else ():
                    ax.axvspan(
                        band.begin, band.end, color=band.colour, alpha=band.opacity, linewidth=0.0, label=band.label
                    )
            axes[-1].set_xlabel(figure.x_label)
            if figure.span:
                axes[-1].set_xlim(*figure.span)
                for ax, panel in zip(axes, figure.panels, strict=True):
                    ax.set_ylim(height(panel, figure.span))
            if figure.ticks:
                axes[-1].set_xticks(range(len(figure.ticks)), figure.ticks)
            canvas.align_ylabels(list(axes))
            _legend(canvas, axes)
        canvas.suptitle(figure.title, fontsize=9)
    return canvas


def _draw_panel(ax: Any, panel: Panel, colour: dict[str, str]) -> None:
    for line in panel.lines:
        kept = thin(line)
        ax.plot(
            *kept.columns,
            color=colour[line.run],
            linestyle="" if line.dots else "-",
            linewidth=0.8 * (WANTED_WIDTH if line.dashed else 1.0),
            marker="." if line.dots else "",
            alpha=0.5 if line.dots else WANTED_OPACITY if line.dashed else 1.0,
            zorder=1.9 if line.dashed else 2.0,
            drawstyle="steps-post" if panel.steps else "default",
            label=line.label,
        )
    ax.set_ylabel(panel.y_label)
    if panel.logarithmic:
        ax.set_yscale("log")


def draw_path(ax: Any, panel: Panel, colour: dict[str, str]) -> None:
    """Draw the lines of a spatial panel on Matplotlib's 3-D axes, all three axes to the same scale."""
    for line in panel.lines:
        wide, alpha = (WANTED_WIDTH, WANTED_OPACITY) if line.dashed else (1.0, 1.0)
        ax.plot(*thin(line).columns, color=colour[line.run], linewidth=0.9 * wide, alpha=alpha, label=line.label)
    spans = bounds(panel)
    ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", xlim=spans[0], ylim=spans[1], zlim=spans[2])
    widest = max(high - low for low, high in spans)
    for axis, (low, high) in zip((ax.xaxis, ax.yaxis, ax.zaxis), spans, strict=True):
        axis.set_major_locator(_ticks(max(2, round(_MOST_TICKS * (high - low) / widest))))
    ax.set_box_aspect([high - low for low, high in spans], zoom=0.85)


def _ticks(most: int) -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(most)


def _legend(canvas: Any, axes: Any) -> None:
    found: dict[str, Any] = {}
    for ax in axes:
        handles, labels = ax.get_legend_handles_labels()
        found.update(zip(labels, handles, strict=True))
    canvas.legend(
        found.values(), found.keys(), loc="outside lower center", ncols=min(5, max(1, len(found))), fontsize=7
    )
