"""The report of a study: one HTML page, and figures for a paper, from the files that ``study`` describes.

``python studies/study_report.py DIR`` builds ``DIR/report.html`` again from the stored flights.
"""

import argparse
import json
import shlex
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from study_figures import metric_figures, tuning_figures
from study_table import comparison_rows

from quad_flight_log.errors import FlightLogError
from quad_report.figures import Figure
from quad_report.flight_figures import CASES, Playback, Run, inside_figures, paper_figures, playback, run_from_tables
from quad_report.page import Page, folded, heading, table, verbatim, write_page

FILES = ("study.json", "flights.parquet", "summary.parquet", "comparison.parquet", "trials.parquet")
_KEYS = ("name", "command", "cases", "plants", "conditions", "seeds", "controllers", "metrics")


class Study(NamedTuple):
    """A study as stored: ``facts`` of study.json, the tables of ``FILES`` (pandas), runs of the examples."""

    facts: dict[str, Any]
    flights: Any
    summary: Any
    comparison: Any
    trials: Any
    examples: tuple[Run, ...]

    @property
    def titles(self) -> dict[str, str]:
        """{controller: title}."""
        return {name: str(about.get("title") or name) for name, about in self.facts["controllers"].items()}


def read_study(directory: Path) -> Study:
    """Read a study; raises FlightLogError naming the file that is missing or not as described."""
    for name in FILES:
        if not (directory / name).is_file():
            raise FlightLogError(f"{directory}: no {name} in it, expected the directory of a finished study")
    try:
        facts = json.loads((directory / "study.json").read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise FlightLogError(f"{directory / 'study.json'}: not JSON ({error})") from error
    missing = [key for key in _KEYS if key not in facts]
    if missing:
        raise FlightLogError(f"{directory / 'study.json'}: no {', '.join(missing)} in it")
    tables = [_parquet(directory / name) for name in FILES[1:]]
    titles = {name: str(about.get("title") or name) for name, about in facts["controllers"].items()}
    examples = [
        run_from_tables(title, case, _example(path))
        for case in facts["cases"]
        for name, title in titles.items()
        if (path := directory / "examples" / f"{name}-{case}.npz").is_file()
    ]
    return Study(facts, *tables, tuple(examples))


def study_page(study: Study, command: str) -> Page:
    """Return the page: results, the paper's figures of each case, what went on inside, how each was tuned and flown."""
    facts = study.facts
    seeds = facts["seeds"]
    lines = [
        ("study made by", str(facts["command"])),
        ("created", str(facts.get("created", ""))),
        ("commit", str(facts.get("commit", ""))),
        ("plan", str(facts.get("plan", ""))),
        ("conditions", str(facts.get("conditions_text", ""))),
        ("held-out seeds", f"{len(seeds)}: {_span(seeds)}"),
        ("training seeds", _span(facts.get("training_seeds", []))),
        ("seed rule", str(facts.get("seed_rule", ""))),
        ("objective", str(facts.get("objective", ""))),
    ]
    head, *rows = comparison_rows(facts, study.comparison)
    body: list[Figure | Playback | str] = [
        heading("Costs over tunings", str(facts.get("conditions_text", ""))),
        table(head, rows),
        *tuning_figures(study.trials, study.titles),
    ]
    for case in facts["cases"]:
        for plant in facts["plants"]:
            for condition in facts["conditions"]:
                body += _results(study, case, plant, condition)
        runs = [run for run in study.examples if run.trajectory == case]
        note = f"One flight per controller, the first held-out seed ({seeds[0] if seeds else 'none'})."
        if runs:
            body += [
                heading(f"{CASES.get(case, case)}: the paper's figures", note),
                *playback(runs),
                *paper_figures(runs),
            ]
            body += [heading(f"Inside the flights of {case}", note), *inside_figures(runs)]
    body += [heading("Controllers, tuning and versions"), _controllers(study), *_folded(study)]
    return Page(f"Study {facts['name']}", command, [each for each in lines if each[1]], body, None, _numbers(study))


def _numbers(study: Study) -> list[tuple[str, str]]:
    """Return the median RMSE of up to three controllers in the first case: what the page opens with."""
    case, plant, condition = (next(iter(study.facts[name])) for name in ("cases", "plants", "conditions"))
    summary = at_place(study.summary, case, plant, condition)
    medians = summary[summary["metric"] == "position_rmse"].set_index("controller")["median"]
    shown = [(name, title) for name, title in study.titles.items() if name in medians.index][:3]
    about = f"RMSE in {case}, {condition}, median"
    return [(f"{1000.0 * medians[name]:.3g} mm", f"{title}: {about}") for name, title in shown]


def at_place(found: Any, case: str, plant: str, condition: str) -> Any:
    """Return the rows of a table (pandas) of this case, plant and condition."""
    return found[(found["case"] == case) & (found["plant"] == plant) & (found["condition"] == condition)]


def write_report(directory: Path, command: str = "") -> Path:
    """Write ``directory/report.html`` and return its path.

    Raises FlightLogError as ``read_study``, or if a file cannot be written.
    """
    again = f"python studies/study_report.py {shlex.quote(str(directory))}"
    return write_page(study_page(read_study(directory), command or again), directory / "report.html")


def _parquet(path: Path) -> Any:
    try:
        import pandas
        import pyarrow
    except ImportError as error:
        raise FlightLogError("studies need pandas and pyarrow: pip install -r requirements/extras.txt") from error
    try:
        return pandas.read_parquet(path)
    except (OSError, ValueError, pyarrow.ArrowException) as error:
        raise FlightLogError(f"{path}: cannot be read ({' '.join(str(error).split())})") from error


def _example(path: Path) -> dict[str, Any]:
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise FlightLogError(f"{path}: cannot be read ({' '.join(str(error).split())})") from error


def _span(seeds: Sequence[int]) -> str:
    if not seeds:
        return ""
    even = len(seeds) > 2 and list(seeds) == list(range(seeds[0], seeds[0] + len(seeds)))
    return f"{seeds[0]} to {seeds[-1]}" if even else ", ".join(map(str, seeds))


def _controllers(study: Study) -> str:
    rows = [
        (study.titles[name], str(about.get("position", "")), str(about.get("attitude", "")))
        for name, about in study.facts["controllers"].items()
    ]
    return table(("controller", "position law", "attitude law"), rows)


def _results(study: Study, case: str, plant: str, condition: str) -> list[Figure | str]:
    rows = {
        (row["controller"], row["metric"]): row
        for row in at_place(study.summary, case, plant, condition).to_dict("records")
    }
    flights = at_place(study.flights, case, plant, condition)
    first, *others = study.titles.values()
    where = f"{case}, plant {plant}, {condition}"
    return [
        heading(f"Results: {where}"),
        heading("Median, and 5 to 95 % of the flights", f"Flights flown to their end: {_ended(study, flights)}."),
        table(
            ("metric", *study.titles.values(), "unit"),
            [_row(rows, study, metric, _median) for metric in study.facts["metrics"]],
        ),
        heading(
            f"Median difference to {first} on the same seeds, and its 95 % confidence interval",
            f"Positive: {first} has less. An interval without 0: other seeds do not explain it; other tunings may.",
        ),
        table(
            ("metric", *others, "unit"),
            [_row(rows, study, metric, _difference, skip=1) for metric in study.facts["metrics"]],
        ),
        *metric_figures(flights, study.titles, study.facts["metrics"], where),
    ]


def _ended(study: Study, flights: Any) -> str:
    endings = []
    for name, title in study.titles.items():
        outcomes = flights.loc[flights["controller"] == name, "outcome"]
        endings.append(f"{title} {int((outcomes == 'ended').sum())} of {len(outcomes)}")
    return ", ".join(endings)


def _row(rows: dict[Any, Any], study: Study, metric: str, cell: Any, skip: int = 0) -> tuple[str, ...]:
    names = list(study.titles)[skip:]
    unit = study.facts["metrics"][metric][0]
    return (metric, *(cell(rows.get((name, metric))) for name in names), str(unit))


def _median(row: Any) -> str:
    if row is None or not np.isfinite(row["median"]):
        return "n/a"
    return f"{row['median']:.4g} [{row['low']:.4g}, {row['high']:.4g}]"


def _difference(row: Any) -> str:
    if row is None or not np.isfinite(row["difference"]):
        return "n/a"
    return f"{row['difference']:+.3g} [{row['difference_low']:+.3g}, {row['difference_high']:+.3g}]"


def _folded(study: Study) -> list[str]:
    texts: dict[str, Any] = {}
    for name, about in study.facts["controllers"].items():
        for part in ("gains", "parameters", "tuning"):
            texts[f"{study.titles[name]}: {part}"] = about.get(part)
    texts["Seeds"] = {key: study.facts.get(key, []) for key in ("seeds", "training_seeds")}
    texts["Metrics"], texts["Versions"] = study.facts["metrics"], study.facts.get("versions")
    return [folded(name, verbatim(yaml.safe_dump(each, sort_keys=False))) for name, each in texts.items() if each]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python studies/study_report.py",
        description="Build the report of a study from its stored flights.",
        epilog="example:\n  python studies/study_report.py results",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("directory", type=Path, metavar="DIR", help="directory that scripts/study wrote")
    options = parser.parse_args(arguments)
    try:
        path = write_report(options.directory)
    except FlightLogError as error:
        sys.stderr.write(f"study_report: {error}\n")
        return 2
    sys.stdout.write(f"{path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
