"""Figures of a study: every flight of every controller as a dot, one panel per metric."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from quad_flight_log.report.figures import Figure, Line, Panel

GROUPS = {
    "tracking": ("position_rmse", "position_max", "position_iae", "position_itae", "settling_time", "position_final"),
    "attitude and effort": ("attitude_rmse", "thrust_effort", "torque_effort", "saturation_time"),
    "smoothness of the torque": ("torque_total_variation", "torque_high_frequency"),
}
_SPREAD = 0.3  # width of a column of dots; controllers are 1 apart
_LOGARITHMIC_FROM = 30.0  # ratio of largest to smallest


def metric_figures(
    flights: Any, titles: Mapping[str, str], metrics: Mapping[str, Sequence[str]], case: str, plant: str
) -> list[Figure]:
    """Return one figure per group of metrics for a case and plant; metrics without a number are left out.

    ``flights``: the table of ``flights.parquet``; ``metrics``: {name: [unit, meaning]}.
    """
    chosen = flights[(flights["case"] == case) & (flights["plant"] == plant)]
    known = {name for names in GROUPS.values() for name in names}
    groups = {**GROUPS, "other metrics": tuple(name for name in metrics if name not in known and name != "duration")}
    figures = []
    for group, names in groups.items():
        panels = [_panel(chosen, titles, name, metrics[name][0]) for name in names if name in metrics]
        panels = [panel for panel in panels if panel.lines]
        if panels:
            figures.append(
                Figure(
                    f"metrics-{case}-{plant}-{group.replace(' ', '-')}",
                    f"{case}, plant {plant}: {group}",
                    "One dot per held-out seed that was flown to its end, the same seeds for every controller.",
                    tuple(panels),
                    x_label="",
                    ticks=tuple(titles.values()),
                )
            )
    return figures


def _panel(chosen: Any, titles: Mapping[str, str], metric: str, unit: str) -> Panel:
    lines = []
    for place, (name, title) in enumerate(titles.items()):
        rows = chosen[chosen["controller"] == name].sort_values("seed")
        values = rows[metric].to_numpy(dtype=float)
        where = place + _SPREAD * (np.linspace(-0.5, 0.5, len(values)) if len(values) > 1 else np.zeros(len(values)))
        finite = np.isfinite(values)
        if finite.any():
            lines.append(Line(title, title, (where[finite], values[finite]), dots=True))
    numbers = np.concatenate([line.columns[1] for line in lines]) if lines else np.ones(1)
    logarithmic = bool(numbers.min() > 0.0 and numbers.max() > _LOGARITHMIC_FROM * numbers.min())
    name, _, rest = metric.partition("_")
    label = f"{name}\n{rest.replace('_', ' ')}" + (f"\n[{unit}]" if unit else "")
    return Panel(label, tuple(lines), logarithmic=logarithmic)
