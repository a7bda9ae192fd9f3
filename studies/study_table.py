"""The tables of a study as Markdown, from its ``summary.parquet``: ``python studies/study_table.py DIR``."""

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from study_statistics import comparison
from study_statistics import summary as compared

RESAMPLES = 9999
EXAMPLES = """examples:
  python studies/study_table.py flights/paper
  python studies/study_table.py flights/paper --against paper-law --metric position_rmse
  python studies/study_table.py flights/paper --plant rigid_body --metric position_rmse --metric attitude_rmse
"""


def tables(directory: Path, plants: Sequence[str] = (), metrics: Sequence[str] = (), against: str = "") -> str:
    """Return all tables of the study in ``directory``; empty ``plants`` or ``metrics``: all.

    ``against``: the controller that the others are compared with (default: the study's first). Raises
    FileNotFoundError if there is no finished study, KeyError for a plant, metric or controller that it has not.
    """
    import pandas

    facts = json.loads((directory / "study.json").read_text(encoding="utf-8"))
    summary, costs = (pandas.read_parquet(directory / f"{name}.parquet") for name in ("summary", "comparison"))
    about = facts["controllers"]
    for chosen, known in (
        (plants, facts["plants"]),
        (metrics, facts["metrics"]),
        ([against or next(iter(about))], about),
    ):
        strange = [name for name in chosen if name not in known]
        if strange:
            raise KeyError(f"found {strange[0]!r}, expected one of {', '.join(known)}")
    shown = list(metrics or facts["metrics"])
    if against:
        facts["controllers"] = {against: about[against], **about}
        flights = pandas.read_parquet(directory / "flights.parquet")
        summary = compared(flights, list(facts["controllers"]), shown, RESAMPLES, 1)
        costs = comparison(flights, list(facts["controllers"]))
    head, *rows = comparison_rows(facts, costs)
    lines = [_line(head), _line(["---"] * len(head)), *map(_line, rows)]
    parts = [f"### Costs over tunings\n\n{facts['conditions_text']}\n\n" + "\n".join(lines) + "\n"]
    for plant in plants or facts["plants"]:
        for case in facts["cases"]:
            for condition in facts["conditions"]:
                here = summary[(summary["case"] == case) & (summary["plant"] == plant)]
                rows = here[here["condition"] == condition].to_dict("records")
                found = {(row["controller"], row["metric"]): row for row in rows}
                parts.append(f"### {case}, plant `{plant}`, {condition}\n\n" + table(facts, found, shown))
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


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def table(facts: Mapping[str, Any], found: Mapping[Any, Mapping[str, Any]], metrics: Sequence[str]) -> str:
    """Return one table: a row per metric, a column per controller; medians, ranges, differences to the first."""
    names = list(facts["controllers"])
    lines = ["| metric | " + " | ".join(facts["controllers"][name]["title"] for name in names) + " |"]
    lines.append("| --- |" + " --- |" * len(names))
    for metric in metrics:
        cells = [cell(found[name, metric]) for name in names]
        if any(cells):
            unit = facts["metrics"][metric][0]
            lines.append(f"| {metric}{f' [{unit}]' if unit else ''} | " + " | ".join(c or "none" for c in cells) + " |")
    ended = [f"{found[name, metrics[0]]['ended']} of {found[name, metrics[0]]['flights']}" for name in names]
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables: 0 done, 2 usage."""
    parser = argparse.ArgumentParser(
        prog="python studies/study_table.py",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("directory", type=Path, metavar="DIR", help="what scripts/study wrote")
    parser.add_argument("--plant", action="append", default=[], help="may be repeated (default: all)")
    parser.add_argument("--metric", action="append", default=[], help="may be repeated (default: all)")
    parser.add_argument("--against", default="", metavar="CONTROLLER", help="what to compare with (default: the first)")
    options = parser.parse_args(arguments)
    try:
        sys.stdout.write(tables(options.directory, options.plant, options.metric, options.against))
    except (OSError, KeyError) as error:
        sys.stderr.write(f"study_table: {options.directory}: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
