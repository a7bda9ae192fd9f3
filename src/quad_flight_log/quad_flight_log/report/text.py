"""Metrics as rows and tables of text."""

import math
from collections.abc import Collection, Mapping, Sequence

from quad_flight_log.analysis.metrics import METRICS, FlightMetrics


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
    noted = [f"{name}: {note}" for name, note in zip(names, notes, strict=False) if note]
    return "\n".join([aligned(metric_rows(names, metrics, limits or {}), range(1, len(names) + 1)), *noted])


def aligned(rows: Sequence[Sequence[str]], right: Collection[int]) -> str:
    """Return rows of cells as aligned lines; the columns in ``right`` are flushed right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(f"{cell:{'>' if at in right else '<'}{widths[at]}}" for at, cell in enumerate(row)).rstrip()
        for row in rows
    )
