"""The tables of a study as Markdown, from its files."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from quad_analysis.text import in_latex, tabular


def tables(directory: Path) -> str:
    """Return all tables of the study in ``directory``."""
    import pandas

    facts = json.loads((directory / "study.json").read_text(encoding="utf-8"))
    summary, costs = (pandas.read_parquet(directory / f"{name}.parquet") for name in ("summary", "comparison"))
    head, *rows = comparison_rows(facts, costs)
    lines = [_line(head), _line(["---"] * len(head)), *map(_line, rows)]
    parts = [f"### Costs over tunings\n\n{facts['conditions_text']}\n\n" + "\n".join(lines) + "\n"]
    for plant in facts["plants"]:
        for case in facts["cases"]:
            for condition in facts["conditions"]:
                here = summary[(summary["case"] == case) & (summary["plant"] == plant)]
                rows = here[here["condition"] == condition].to_dict("records")
                found = {(row["controller"], row["metric"]): row for row in rows}
                parts.append(f"### {case}, plant `{plant}`, {condition}\n\n" + table(facts, found))
    return "\n".join(parts)


def comparison_rows(facts: Mapping[str, Any], costs: Any) -> list[list[str]]:
    """Return head and rows of the table of costs, ``costs`` being comparison.parquet; bold: a difference that stands.

    It stands if p after Holm's procedure is below 0.05.
    """
    first = next(iter(facts["controllers"].values()))["title"]
    found = [["condition", "controller", "tunings", "cost (95 %)", f"beside {first} (95 %)", "p, Holm", "flights lost"]]
    for row in costs.to_dict("records"):
        cost, beside, p = f"{row['cost']:.3f}", "", ""
        if math.isfinite(row["cost_low"]):
            cost += f" ({row['cost_low']:.3f} to {row['cost_high']:.3f})"
        if math.isfinite(row["ratio"]):
            beside = f"{100.0 * (row['ratio'] - 1.0):+.1f} %"
        if math.isfinite(row["p"]):
            beside += f" ({100.0 * (row['ratio_low'] - 1.0):+.1f} to {100.0 * (row['ratio_high'] - 1.0):+.1f})"
            beside = f"**{beside}**" if row["p_holm"] < 0.05 else beside
            p = f"{row['p_holm']:.2g}"
        title = facts["controllers"][row["controller"]]["title"]
        found.append([row["condition"], title, str(row["tunings"]), cost, beside, p, str(row["lost"])])
    return found


def latex(rows: Sequence[Sequence[str]]) -> str:
    """Return rows, the head first, as a LaTeX tabular without packages; cells in ``**`` are bold."""
    cells = [
        [rf"\textbf{{{in_latex(cell.strip('*'))}}}" if cell[:2] == "**" else in_latex(cell) for cell in row]
        for row in rows
    ]
    return tabular("l" * len(rows[0]), cells) + "\n"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def table(facts: Mapping[str, Any], found: Mapping[Any, Mapping[str, Any]]) -> str:
    """Return one table: a row per metric, a column per controller; medians, ranges, differences to the first."""
    names = list(facts["controllers"])
    lines = ["| metric | " + " | ".join(facts["controllers"][name]["title"] for name in names) + " |"]
    lines.append("| --- |" + " --- |" * len(names))
    for metric in facts["metrics"]:
        cells = [cell(found[name, metric]) for name in names]
        if any(cells):
            unit = facts["metrics"][metric][0]
            lines.append(f"| {metric}{f' [{unit}]' if unit else ''} | " + " | ".join(c or "none" for c in cells) + " |")
    every = [found[name, "cost"] for name in names]
    ended = [f"{row['ended']} of {row['flights']}" for row in every]
    lines.append("| flown to the end | " + " | ".join(ended) + " |")
    return "\n".join(lines) + "\n"


def cell(row: Mapping[str, Any]) -> str:
    """Return median (5 % .. 95 %) and, below it, the paired difference with its interval; empty without a number."""
    if math.isnan(row["median"]):
        return ""
    text = f"{row['median']:.3g} ({row['low']:.3g} .. {row['high']:.3g})"
    if math.isnan(row["difference"]):
        return text
    return text + f"<br>{row['difference']:+.2g} [{row['difference_low']:+.2g}, {row['difference_high']:+.2g}]"
