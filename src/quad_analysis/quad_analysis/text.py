"""Metrics as rows, and as tables of text, CSV and LaTeX."""

import csv
import io
import math
from collections.abc import Collection, Mapping, Sequence

from quad_analysis.metrics import METRICS, FlightMetrics


def metric_rows(
    names: Sequence[str],
    metrics: Sequence[FlightMetrics],
    limits: Mapping[str, float],
    shown: Collection[str] = tuple(METRICS),
) -> list[list[str]]:
    """Return a head and one row per metric: name, a cell per flight, unit, and the limit if there are any."""
    rows = [["metric", *names, "unit", *(["limit"] if limits else [])]]
    for name, about in METRICS.items():
        if name in shown:
            cells = [number(getattr(item, name), about.unit) for item in metrics]
            limit = [number(limits[name], about.unit) if name in limits else ""] if limits else []
            rows.append([name, *cells, about.unit, *limit])
    return rows


def number(value: float | None, unit: str = "") -> str:
    """Return a value with five digits, an angle in rad with its degrees; ``n/a`` for None."""
    if value is None:
        return "n/a"
    return f"{value:.5g} ({math.degrees(value):.3g} deg)" if unit == "rad" else f"{value:.5g}"


def table(
    names: Sequence[str],
    metrics: Sequence[FlightMetrics],
    limits: Mapping[str, float] | None = None,
    notes: Sequence[str] = (),
) -> str:
    """Return a text table, one line per metric, one column per flight, with the limits held to if there are any.

    ``notes``: what else is to be known of the metrics of each flight, empty if nothing is.
    """
    rows = metric_rows(names, metrics, limits or {})
    return "\n".join([aligned(rows, range(1, len(names) + 1)), *noted(names, notes)])


def noted(names: Sequence[str], notes: Sequence[str]) -> list[str]:
    """Return a line for each flight of which something is to be known."""
    return [f"{name}: {note}" for name, note in zip(names, notes, strict=False) if note]


def csv_table(names: Sequence[str], metrics: Sequence[FlightMetrics]) -> str:
    """Return CSV, one line per flight, every digit of each metric; empty without one."""
    cells = [
        [name, *("" if value is None else repr(value) for value in item)]
        for name, item in zip(names, metrics, strict=True)
    ]
    with io.StringIO() as stream:
        csv.writer(stream, lineterminator="\n").writerows([["flight", *METRICS], *cells])
        return stream.getvalue().rstrip("\n")


def latex_table(names: Sequence[str], metrics: Sequence[FlightMetrics]) -> str:
    """Return a LaTeX tabular without packages, one line per metric that a flight has, the least of several bold."""
    rows = [["metric", *map(in_latex, names), "unit"]]
    for name, about in METRICS.items():
        values = [getattr(item, name) for item in metrics]
        known = {value for value in values if value is not None}
        least = _number(min(known)) if len(set(map(_number, known))) > 1 and name != "duration" else ""
        shown = ["--" if value is None else _number(value) for value in values]
        cells = [rf"$\mathbf{{{cell}}}$" if cell == least else cell if cell == "--" else f"${cell}$" for cell in shown]
        unit = rf"$\mathrm{{{about.unit.replace(' ', '~')}}}$" if about.unit else ""
        if known:
            rows.append([name.replace("_", " "), *cells, unit])
    return tabular(f"l{'r' * len(names)}l", rows)


def tabular(columns: str, rows: Sequence[Sequence[str]]) -> str:
    """Return cells that are LaTeX already, the head first, as a tabular with lines around head and body."""
    head, *body = [" & ".join(row) + r" \\" for row in rows]
    begin = [rf"\begin{{tabular}}{{{columns}}}", r"\hline", head, r"\hline"]
    return "\n".join([*begin, *body, r"\hline", r"\end{tabular}"])


def _number(value: float) -> str:
    digits, _, exponent = f"{value:.4g}".partition("e")
    return rf"{digits}\cdot10^{{{int(exponent)}}}" if exponent else digits


def in_latex(text: str) -> str:
    """Return a text with LaTeX's own characters escaped."""
    named = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
    return "".join(named.get(each, f"\\{each}" if each in "&%$#_{}" else each) for each in text)


def aligned(rows: Sequence[Sequence[str]], right: Collection[int]) -> str:
    """Return rows of cells as aligned lines; the columns in ``right`` are flushed right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(f"{cell:{'>' if at in right else '<'}{widths[at]}}" for at, cell in enumerate(row)).rstrip()
        for row in rows
    )
