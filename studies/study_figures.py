"""Figures of a study: flights as dots, one panel per metric; best cost over trials; error against effort of trials."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from study_statistics import front

from quad_report.figures import Figure, Line, Panel

GROUPS = {
    "tracking": ("position_rmse", "position_max", "position_iae", "position_itae", "settling_time", "position_final"),
    "attitude and effort": ("attitude_rmse", "thrust_effort", "torque_effort", "saturation_time"),
    "smoothness of the torque": ("torque_total_variation", "torque_high_frequency"),
}
_SPREAD = 0.3  # width of a column of dots; controllers are 1 apart
_LOGARITHMIC_FROM = 30.0  # ratio of largest to smallest


def metric_figures(
    flights: Any, titles: Mapping[str, str], metrics: Mapping[str, Sequence[str]], where: str
) -> list[Figure]:
    """Return one figure per group of metrics; metrics without a number are left out.

    ``flights``: rows of ``flights.parquet``, ``where`` they were flown; ``metrics``: {name: [unit, meaning]}.
    """
    known = {name for names in GROUPS.values() for name in names}
    groups = {**GROUPS, "other metrics": tuple(name for name in metrics if name not in known and name != "duration")}
    figures = []
    for group, names in groups.items():
        panels = [_panel(flights, titles, name, metrics[name][0]) for name in names if name in metrics]
        panels = [panel for panel in panels if panel.lines]
        if panels:
            figures.append(
                Figure(
                    f"metrics-{where.replace('plant ', '')}-{group}".replace(", ", "-").replace(" ", "-"),
                    f"{where}: {group}",
                    "One dot per held-out flight to its end, the same seeds for every controller.",
                    tuple(panels),
                    x_label="",
                    ticks=tuple(titles.values()),
                )
            )
    return figures


def cost_figure(flights: Any, titles: Mapping[str, str]) -> Figure:
    """Return the costs of all tunings, means over held-out flights: one dot per tuning, a column per controller."""
    costs = flights.groupby(["controller", "tuning"], as_index=False)["cost"].mean()
    costs["seed"] = costs["tuning"]
    panel = _panel(costs, titles, "cost", "")
    caption = "One dot per tuning: its mean over all held-out flights and conditions."
    return Figure("costs", "Costs over tunings", caption, (panel,), x_label="", ticks=tuple(titles.values()))


def tuning_figures(trials: Any, titles: Mapping[str, str]) -> list[Figure]:
    """Return the best cost over trials (has the search reached a plateau?) and the fronts of error against effort.

    ``trials``: the table of ``trials.parquet``. A front is of all trials of all tunings of a controller: those that no
    other beats in both means over the training flights.
    """
    best, fronts = [], []
    for name, title in titles.items():
        own = trials[trials["controller"] == name]
        if own.empty:
            continue
        table = own.pivot_table(index="number", columns="tuning", values="cost").cummin()
        columns = (table.index.to_numpy(float), table.median(axis=1).to_numpy(float))
        best.append(Line(title, title, columns))
        error, effort = (own[column].to_numpy(float) for column in ("rmse", "variation"))
        place = front(error, effort)
        fronts.append(Line(title, title, (effort[place], 1e3 * error[place])))
    figures = [
        Figure(
            "plateau",
            "Best cost over trials",
            "Median over the tunings; a curve that still falls at its end means a budget too small for a ranking.",
            (Panel("best cost", tuple(best), logarithmic=True),),
            x_label="trial",
        ),
        Figure(
            "front",
            "Error against effort",
            "Means over the training flights of all trials that no other beats in both: no weight enters.",
            (Panel("RMSE\n[mm]", tuple(fronts), logarithmic=True),),
            x_label="torque variation [N m/s]",
        ),
    ]
    return figures if best else []


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
