"""What came of a campaign: success rate with exact bounds, quantiles, worst cases, and a page with pictures."""

import html
import shlex
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from quad_campaign.batch import FIGURES
from quad_campaign.definition import Definition, command
from quad_core.parameters import Value

CONFIDENCE = 0.95
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
_WORST = 10
_DRAWN = 5000


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
    """Return the quantiles of each figure over the flights that ended; NaN if none did."""
    ended = frame[frame["outcome"] == "ended"]
    return pd.DataFrame({name: [ended[name].quantile(q) for q in QUANTILES] for name in FIGURES}, index=list(QUANTILES))


def worst(frame: pd.DataFrame, count: int = _WORST) -> pd.DataFrame:
    """Return the worst flights: those that did not end, soonest first, then those with the largest RMSE."""
    lost = frame[frame["outcome"] != "ended"].sort_values("steps")
    ended = frame[frame["outcome"] == "ended"].sort_values("rmse", ascending=False)
    return pd.concat([lost, ended]).head(count)


def refly_command(definition: Definition, row: dict[str, Any]) -> str:
    """Return the shell command that flies a row of the campaign over ROS."""
    values: dict[str, Value] = {name: _plain(row[name]) for name in definition.vary}
    return shlex.join(["scripts/fly", *command(definition, values)])


def text(definition: Definition, frame: pd.DataFrame, again: str) -> str:
    """Return the summary for a terminal; ``again`` is the command that flies a number again, without the number."""
    found = success(frame)
    limits = ", ".join(f"{name} <= {limit:g} m" for name, limit in definition.success.items())
    asked = f" (ended, {limits})" if limits else ""
    rate = f"{100 * found.share:.2f} %, 95 % bounds {100 * found.low:.2f} to {100 * found.high:.2f} % (Clopper-Pearson)"
    lines = [
        f"{definition.name}: {found.good} of {found.flights} flights succeeded{asked}: {rate}",
        "",
        "quantiles of the flights that ended",
        quantiles(frame).to_string(float_format=lambda x: f"{x:.4g}"),
        "",
        "worst flights, and how each is flown over ROS with a bag",
    ]
    lines += [
        f"  {row['outcome']:10s} rmse {row['rmse']:.4g} m  {again} {row['flight']}"
        for row in worst(frame).to_dict("records")
    ]
    return "\n".join(lines)


def page(definition: Definition, frame: pd.DataFrame, about: dict[str, Any]) -> str:
    """Return a page that opens from disk without a network: figures, tables and the commands of the worst flights."""
    from plotly.io import to_html

    pictures = _pictures(definition, frame)
    parts = [to_html(figure, full_html=False, include_plotlyjs=i == 0) for i, figure in enumerate(pictures)]
    found = success(frame)
    rows = worst(frame).to_dict("records")
    cases = "".join(
        f"<tr><td>{row['flight']}</td><td>{row['outcome']}</td><td>{row['rmse']:.4g}</td>"
        f"<td><code>{html.escape(refly_command(definition, row))}</code></td></tr>"
        for row in rows
    )
    facts = "".join(f"<tr><td>{html.escape(k)}</td><td>{html.escape(str(v))}</td></tr>" for k, v in about.items())
    return f"""<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(definition.name)}</title>
<style>body{{font-family:sans-serif;max-width:75em;margin:2em auto}}td,th{{padding:.2em .6em;text-align:left}}
table{{border-collapse:collapse}}tr:nth-child(even){{background:#f3f3f3}}code{{font-size:.8em}}</style></head><body>
<h1>{html.escape(definition.name)}</h1><p>{html.escape(definition.about)}</p>
<p><b>{found.good} of {found.flights}</b> flights succeeded: {100 * found.share:.2f} %, 95 % bounds
{100 * found.low:.2f} to {100 * found.high:.2f} % (Clopper-Pearson).</p>
{quantiles(frame).to_html(float_format=lambda x: f"{x:.4g}", border=0)}
{"".join(parts)}
<h2>Worst flights</h2><table><tr><th>flight</th><th>outcome</th><th>RMSE, m</th><th>over ROS, with a bag</th></tr>
{cases}</table><h2>How it was made</h2><table>{facts}</table></body></html>"""


def write_page(path: Path, definition: Definition, frame: pd.DataFrame, about: dict[str, Any]) -> None:
    """Write the page."""
    path.write_text(page(definition, frame, about), encoding="utf-8")


def _pictures(definition: Definition, frame: pd.DataFrame) -> list[Any]:
    import plotly.graph_objects as go

    ended = frame[frame["outcome"] == "ended"]
    spread = go.Figure([go.Histogram(x=ended["rmse"], nbinsx=80)])
    spread.update_layout(title="RMSE of the flights that ended", xaxis_title="RMSE, m", yaxis_title="flights")
    found = [spread]
    shown = frame.head(_DRAWN)
    for name in definition.vary:
        if name == "flight.seed" or shown[name].nunique() < 2:
            continue
        figure = go.Figure()
        for good, label in ((True, "success"), (False, "no success")):
            chosen = shown[shown["success"] == good]
            heights = np.where(chosen["outcome"] == "ended", chosen["rmse"], np.nan)
            figure.add_scattergl(
                x=chosen[name], y=heights, mode="markers", name=label, marker={"size": 4}, text=chosen["flight"]
            )
        lost = shown[shown["outcome"] != "ended"]
        top = float(ended["rmse"].max()) if len(ended) else 1.0
        figure.add_scattergl(
            x=lost[name], y=np.full(len(lost), top), mode="markers", name="lost (drawn on top)", text=lost["flight"]
        )
        figure.update_layout(title=f"RMSE over {name}", xaxis_title=name, yaxis_title="RMSE, m", height=420)
        found.append(figure)
    return found


def _plain(value: Any) -> Value:
    plain: Value = value.item() if hasattr(value, "item") else value
    return plain
