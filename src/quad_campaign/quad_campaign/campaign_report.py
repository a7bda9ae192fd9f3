"""What came of a campaign: success rate with exact bounds, quantiles, worst cases, and a page with pictures."""

import shlex
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from quad_campaign.definition import Definition, command
from quad_campaign.statistics import Pairs, influences
from quad_core.parameters import Value
from quad_flight.score import MEASURES
from quad_flight.variation import SEED, Variation
from quad_report.figures import Figure, Line, Panel
from quad_report.page import Page, folded, heading, table, verbatim

CONFIDENCE = 0.95
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
_WORST = 10
_DRAWN = 1500  # flights in a figure; all are in the tables and the curve


class Success(NamedTuple):
    """``good`` of ``flights`` succeeded: their share and its two-sided Clopper-Pearson bounds at 95 %."""

    good: int
    flights: int
    share: float
    low: float
    high: float


def success(frame: pd.DataFrame) -> Success:
    """Return how many flights succeeded, with exact bounds."""
    from scipy.stats import binomtest

    good, flights = int(frame["success"].sum()), len(frame)
    bounds = binomtest(good, flights).proportion_ci(CONFIDENCE, "exact")
    return Success(good, flights, good / flights, float(bounds.low), float(bounds.high))


def quantiles(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the quantiles of each measure over the flights that ended; NaN if none did."""
    return frame[frame["outcome"] == "ended"][list(MEASURES)].quantile(list(QUANTILES))


def worst(frame: pd.DataFrame, count: int = _WORST) -> pd.DataFrame:
    """Return the worst flights: those that did not end, soonest first, then those with the largest RMSE."""
    lost = frame[frame["outcome"] != "ended"].sort_values("steps")
    ended = frame[frame["outcome"] == "ended"].sort_values("rmse", ascending=False)
    return pd.concat([lost, ended]).head(count)


def text(definition: Definition, frame: pd.DataFrame) -> str:
    """Return the outcome in one line, and what was asked for."""
    good, flights, share, low, high = success(frame)
    bounds = f"95 % bounds {100 * low:.2f} to {100 * high:.2f} % (Clopper-Pearson)"
    limits = ", ".join(f"{name} at most {limit:g} m" for name, limit in definition.success.items())
    asked = f" (a success ended, {limits})" if limits else ""
    return f"{good} of {flights} flights succeeded: {100 * share:.2f} %, {bounds}{asked}"


def page(
    definition: Definition,
    variation: Variation,
    frame: pd.DataFrame,
    about: dict[str, Any],
    against: tuple[str, Pairs] | None = None,
) -> Page:
    """Return the page: verdict, three numbers, the errors of all flights, then the parameters and the worst flights.

    ``against``: the name of a campaign that drew the same values, and what came of the pairs.
    """
    found, ended = success(frame), frame[frame["outcome"] == "ended"]
    rows = [
        [str(q), *(f"{value:.4g}" for value in row)]
        for q, row in zip(QUANTILES, quantiles(frame).to_numpy(), strict=True)
    ]
    head = ["share of the flights", *(f"{name} [{measure.unit}]" for name, measure in MEASURES.items())]
    cases = [
        [str(row["flight"]), row["outcome"], f"{row['rmse']:.4g}", _refly(definition, row)]
        for row in worst(frame).to_dict("records")
    ]
    body: list[Figure | str] = [heading("", definition.about), _curve(ended)]
    if against is not None:
        body += [heading(f"Against {against[0]}, flight by flight", pairs_text(*against)), _pairs_table(*against)]
    body += [heading("Quantiles of the flights that ended"), table(head, rows)]
    body += _ranking(definition, frame)
    body += [heading("Worst flights"), table(("flight", "outcome", "RMSE [m]", "over ROS, with a bag"), cases)]
    body += [heading("RMSE over each parameter", f"The first {min(len(frame), _DRAWN)} flights.")]
    body += _scatters(definition, variation, frame)
    body.append(folded("Campaign file", verbatim(str(about.get("file text", "")))))
    facts = [(name, str(value)) for name, value in about.items() if name not in ("command", "file text")]
    numbers = [(f"{100 * found.share:.4g} %", "flights succeeded")]
    if len(ended):
        numbers += [(f"{1000 * ended['rmse'].median():.3g} mm", "RMSE, median")]
        numbers += [(f"{1000 * ended['rmse'].quantile(0.95):.3g} mm", "RMSE, 95 % of the flights")]
    verdict = ("good" if found.good == found.flights else "failed", text(definition, frame))
    return Page(f"Campaign {definition.name}", str(about["command"]), facts, body, verdict, numbers)


def pairs_text(name: str, pairs: Pairs) -> str:
    """Return in a sentence which of two campaigns has the smaller errors, as far as the flights tell."""
    sides = {True: "smaller", False: "larger"}
    told = not pairs.low <= 1.0 <= pairs.high
    verdict = (
        f"RMSE {sides[pairs.ratio < 1.0]} than that of {name}" if told else f"no difference of RMSE to {name} told"
    )
    bounds = f"median ratio {pairs.ratio:.3f}, 95 % bounds {pairs.low:.3f} to {pairs.high:.3f}"
    return f"{verdict}: {bounds}, {pairs.ended} flights that both ended."


def _pairs_table(name: str, pairs: Pairs) -> str:
    rows = [
        ["both", str(pairs.both)],
        ["this one alone", str(pairs.ours_alone)],
        [f"{name} alone", str(pairs.theirs_alone)],
        ["neither", str(pairs.neither)],
        ["p that chance alone gives it (McNemar, exact)", f"{pairs.p:.3g}"],
    ]
    return table(("success of", "flights"), rows)


def _ranking(definition: Definition, frame: pd.DataFrame) -> list[Figure | str]:
    rows = [
        [each.parameter, f"{100 * each.share:.1f} %", f"{each.p:.2g}", each.best if each.p < 0.05 else "not told"]
        for each in influences(frame, definition.vary)
    ]
    if not rows:
        return []
    head = ("parameter", "share of the order of flights", "p that chance alone gives it", "best flights at")
    about = (
        "How much of the order of flights by RMSE each parameter explains alone; what it does with others is left out."
    )
    return [heading("Which parameters decide", about), table(head, rows)]


def _refly(definition: Definition, row: dict[str, Any]) -> str:
    """Return the shell command that flies a row of the campaign over ROS."""
    values: dict[str, Value] = {name: row[name] for name in definition.vary}
    return shlex.join(["scripts/fly", *command(definition, values)])


def _curve(ended: pd.DataFrame) -> Figure:
    lines = []
    for name, label in (("rmse", "RMSE"), ("largest_error", "largest error"), ("last_error", "last error")):
        values = np.sort(ended[name].to_numpy(dtype=float))
        lines.append(Line(label, label, (values, 100.0 * np.arange(1, len(values) + 1) / max(1, len(values)))))
    caption = "How many of the flights that ended stayed below an error."
    panel = Panel("share of flights [%]", tuple(lines), steps=True)
    return Figure("errors", "Errors of the flights that ended", caption, (panel,), x_label="error [m]")


def _scatters(definition: Definition, variation: Variation, frame: pd.DataFrame) -> list[Figure]:
    shown, found = frame.head(_DRAWN), []
    top = float(shown.loc[shown["outcome"] == "ended", "rmse"].max())
    heights = shown["rmse"].where(shown["outcome"] == "ended", top if np.isfinite(top) else 1.0).to_numpy(dtype=float)
    kinds = {
        "success": shown["success"],
        "no success": ~shown["success"] & (shown["outcome"] == "ended"),
        "did not end (drawn at the top)": shown["outcome"] != "ended",
    }
    for name in definition.vary:
        if name == SEED or shown[name].nunique() < 2:
            continue
        spec = variation.field(name).spec
        values, names = shown[name].to_numpy(), np.zeros(0)
        if values.dtype.kind not in "iuf":
            names, values = np.unique(values.astype(str), return_inverse=True)
        columns = {label: (values[chosen].astype(float), heights[chosen]) for label, chosen in kinds.items()}
        lines = tuple(Line(label, label, each, dots=True) for label, each in columns.items() if len(each[0]))
        unit = getattr(spec, "unit", "")
        x_label = f"{name} [{unit}]" if unit else name
        panel = Panel("RMSE [m]", lines)
        ticks = tuple(str(each) for each in names)
        found.append(Figure(f"rmse-{name}", name, spec.meaning, (panel,), x_label=x_label, ticks=ticks))
    return found
