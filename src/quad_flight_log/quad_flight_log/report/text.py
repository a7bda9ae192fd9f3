"""Metrics for people (table), programs (JSON) and spreadsheets (CSV), and the check against limits."""

import csv
import io
import json
import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from quad_core.parameter_files import load_yaml
from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.analysis.replay import Replay
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import FlightLogError

_LONGEST = 300  # characters of a name or note in a table


class LimitsError(FlightLogError):
    """A limits file or argument names no metric or no number."""


class Verdict(NamedTuple):
    """One limit and whether it was met: ``value`` None (not available) never meets it."""

    metric: str
    value: float | None
    limit: float

    @property
    def met(self) -> bool:
        """Whether the value exists and is at most the limit."""
        return self.value is not None and self.value <= self.limit


def table(
    names: Sequence[str],
    metrics: Sequence[FlightMetrics],
    limits: Mapping[str, float] | None = None,
    damage: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> str:
    """Return a text table, one line per metric, one column per flight, with the limits held to if there are any.

    ``damage``: what is wrong with the bag of each flight, empty if nothing is; also in the functions below.
    ``notes``: what else is to be known of the metrics of each flight, empty if nothing is.
    """
    limits = limits or {}
    header = ["metric", *names, "unit", *(["limit"] if limits else [])]
    rows = [header]
    for name, about in METRICS.items():
        values = [_number(getattr(item, name)) for item in metrics]
        rows.append([name, *values, about.unit, *([_number(limits[name]) if name in limits else ""] if limits else [])])
    cut = [
        f"{name}: the bag is cut ({problem}): these are the metrics of what is left"
        for name, problem in zip(names, damage, strict=False)
        if problem
    ]
    said = [f"{name}: {note}" for name, note in zip(names, notes, strict=False) if note]
    return "\n".join([text_table(rows, right=range(1, len(names) + 1)), *cut, *said])


def text_table(rows: Sequence[Sequence[str]], right: Collection[int]) -> str:
    """Return rows of cells as aligned lines; the columns in ``right`` are flushed right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if column in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def _number(value: float | None) -> str:
    return "n/a" if value is None else f"{value:.5g}"


def as_json(
    names: Sequence[str], metrics: Sequence[FlightMetrics], damage: Sequence[str] = (), notes: Sequence[str] = ()
) -> str:
    """Return a JSON list, one object per flight; what is not available is null."""
    nothing = [""] * len(names)
    rows = zip(names, metrics, damage or nothing, notes or nothing, strict=True)
    content = [{"flight": name, **item._asdict(), "damage": cut, "note": note} for name, item, cut, note in rows]
    return json.dumps(content, indent=2)


def as_csv(
    names: Sequence[str], metrics: Sequence[FlightMetrics], damage: Sequence[str] = (), notes: Sequence[str] = ()
) -> str:
    """Return CSV, one line per flight; what is not available is empty. The header names the units."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["flight", *(f"{name} [{about.unit}]" for name, about in METRICS.items()), "damage", "note"])
    nothing = [""] * len(names)
    for name, item, problem, note in zip(names, metrics, damage or nothing, notes or nothing, strict=True):
        writer.writerow([name, *("" if value is None else repr(value) for value in item), problem, note])
    return out.getvalue()


def read_limits(arguments: Sequence[str]) -> dict[str, float]:
    """Return {metric: largest allowed value} of ``KEY=VALUE`` arguments and YAML files of such pairs; later ones win.

    Raises LimitsError naming file or argument and what is wrong.
    """
    limits: dict[str, float] = {}
    for argument in arguments:
        name, equals, value = argument.partition("=")
        if equals and not Path(argument).exists():
            limits[_known(name, argument)] = _finite(name, value, argument)
            continue
        try:
            content = load_yaml(Path(argument).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise LimitsError(f"{argument}: cannot be read: {' '.join(str(error).split())}") from error
        if not isinstance(content, dict):
            raise LimitsError(f"{argument}: found {type(content).__name__}, expected a map of metric to limit")
        for key, limit in content.items():
            limits[_known(key, argument)] = _finite(key, limit, argument)
    return limits


def _known(name: object, where: str) -> str:
    if not isinstance(name, str) or name not in METRICS:
        raise LimitsError(f"{where}: {name!r} is no metric; there are {', '.join(METRICS)}")
    return name


def _finite(name: object, value: object, where: str) -> float:
    try:
        number = float(value) if isinstance(value, str | int | float) and not isinstance(value, bool) else math.nan
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise LimitsError(f"{where}: {name}: found {value!r}, expected a finite number")
    return number


def judged(metrics: FlightMetrics, limits: Mapping[str, float]) -> list[Verdict]:
    """Return the verdict on every limit."""
    return [Verdict(name, getattr(metrics, name), limit) for name, limit in limits.items()]


def info_text(flight: Flight) -> str:
    """Return what is in a bag, for people."""
    state = f"truncated: {flight.damage}" if flight.truncated else "complete"
    checked = "every message under a checksum" if flight.protected else "not every message under a checksum"
    lines = [
        str(flight.path),
        f"  {state}, {checked}, written by {flight.written_by or 'unknown'}",
        f"  {flight.size} bytes on disk, {flight.uncompressed_size} uncompressed",
    ]
    lines += [f"  {_line(key)}: {_line(value)}" for key, value in sorted(flight.metadata.items())]
    rows = [["topic", "messages", "bytes", "share", "rate", "dropped", "type"]]
    payload = sum(topic.size for topic in flight.topics.values())
    for topic in flight.topics.values():
        span = (topic.last - topic.first) * 1e-9
        rate = f"{(topic.messages - 1) / span:.1f} Hz" if topic.messages > 1 and span > 0.0 else "-"
        share = f"{100.0 * topic.size / payload:.1f} %" if payload else "-"
        dropped = flight.metadata.get(f"dropped.{topic.name}", "0")
        size = str(topic.size)
        rows.append([_line(topic.name), str(topic.messages), size, share, rate, _line(dropped), _line(topic.type)])
    lines += [f"  {line}" for line in text_table(rows, right=range(1, 6)).splitlines()]
    return "\n".join(lines)


def _line(text: str) -> str:
    """Return text of a bag as one short line, so that it cannot pass for lines of ours."""
    short = text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."
    return short.replace("\n", "\\n").replace("\t", "\\t")


def info_json(flights: Sequence[Flight]) -> str:
    """Return a JSON list, one object per bag."""
    return json.dumps(
        [
            {
                "path": str(flight.path),
                "truncated": flight.truncated,
                "damage": flight.damage,
                "protected": flight.protected,
                "library": flight.written_by,
                "bytes": flight.size,
                "uncompressed_bytes": flight.uncompressed_size,
                "metadata": flight.metadata,
                "topics": [topic._asdict() for topic in flight.topics.values()],
            }
            for flight in flights
        ],
        indent=2,
    )


def replay_text(item: Replay) -> str:
    """Return the result for people: one line if all is equal, else the numbers that differ."""
    kind = "changed parameters" if item.changed else "recorded parameters"
    head = f"{item.role}: {item.law}, {kind}, {len(item.steps)} steps, {len(item.recorded)} numbers each"
    lines = [head, *(f"  {note}" for note in item.notes)]
    if item.missing:
        lines.append(f"  {item.missing} steps were answered only in one of record and replay")
    differing = [difference for difference in item.differences() if difference.differing]
    if not differing:
        return "\n".join([*lines, "  every bit is equal" if item.equal else "  nothing differs where both answered"])
    rows = [["number", "steps that differ", "first", "largest", "rms", "recorded rms"]]
    for one in differing:
        numbers = (one.largest, one.rms, one.recorded_rms)
        rows.append([one.name, str(one.differing), str(one.first_step), *(f"{number:.4g}" for number in numbers)])
    lines += [f"  {line}" for line in text_table(rows, right=range(1, 6)).splitlines()]
    return "\n".join(lines)


def replay_json(items: list[Replay]) -> str:
    """Return the result for programs."""
    content = [
        {
            "role": item.role,
            "law": item.law,
            "changed": item.changed,
            "equal": item.equal,
            "steps": len(item.steps),
            "missing": item.missing,
            "notes": item.notes,
            "differences": [one._asdict() for one in item.differences() if one.differing],
        }
        for item in items
    ]
    return json.dumps(content, indent=2)
