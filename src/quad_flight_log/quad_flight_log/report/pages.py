"""Reports of one flight and of several in the same figures."""

import math
from collections.abc import Mapping, Sequence

from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.analysis.tables import text_table, truth_note
from quad_flight_log.bag.reader import Flight
from quad_flight_log.report.figures import Figure
from quad_flight_log.report.flight_figures import (
    CASES,
    Run,
    by_trajectory,
    inside_figures,
    paper_figures,
    run_from_flight,
    with_bands,
)
from quad_flight_log.report.page import Page, folded, heading, table, verbatim
from quad_flight_log.report.text import metric_rows
from quad_flight_log.report.verdict import judgement

_METRICS = ("duration", "position_rmse", "position_max", "position_final", "settling_time", "attitude_rmse")
_FACTS = ("run_id", "outcome", "reason", "seed", "mode", "steps", "real_time_factor", "started", "git_commit")


def names_of(flights: Sequence[Flight]) -> list[str]:
    """Return a short name for each flight, all different: the bag's folder, numbered where two are alike."""
    short = [flight.name for flight in flights]
    return [
        name if name not in short[:at] else f"{name} ({1 + short[:at].count(name)})" for at, name in enumerate(short)
    ]


def flight_page(flight: Flight, name: str, command: str, limits: Mapping[str, float] | None = None) -> Page:
    """Return the report of one flight: verdict, three numbers and the path, then figures, metrics, events, parameters.

    ``limits``: what to hold it to instead of the limits that the bag notes.
    """
    run = run_from_flight(flight, name)
    judged = judgement(flight, run.metrics, limits)
    facts = [("bag", str(flight.path))] + [
        (key, flight.metadata[key]) for key in (*_FACTS, "command") if flight.metadata.get(key)
    ]
    figures = paper_figures([run])
    body: list[Figure | str] = [heading("", truth_note(flight)), *figures[:1]]
    body += _case([run], figures[1:], judged.limits)
    body += [heading("Inside the flight"), *with_bands(inside_figures([run]), [run]), *_flown_with([flight], [name])]
    return Page(f"Flight {name}", command, facts, body, (judged.good, judged.text), _numbers(run.metrics))


def comparison_page(flights: Sequence[Flight], names: Sequence[str], command: str) -> Page:
    """Return the report of several flights: one set of figures for each trajectory, all its flights in them."""
    runs = [run_from_flight(flight, name) for flight, name in zip(flights, names, strict=True)]
    notes = [(name, str(flight.path), truth_note(flight)) for flight, name in zip(flights, names, strict=True)]
    body: list[Figure | str] = []
    for _, group in by_trajectory(runs):
        body += _case(group, paper_figures(group))
    for trajectory, group in by_trajectory(runs):
        body.append(heading(f"Inside the flights{f' of {trajectory}' if trajectory else ''}"))
        body += with_bands(inside_figures(group), group)
    facts = [(name, "; ".join(filter(None, rest))) for name, *rest in notes]
    return Page(f"Comparison of {', '.join(names)}", command, facts, [*body, *_flown_with(flights, names)])


def _numbers(metrics: FlightMetrics) -> list[tuple[str, str]]:
    """Return the three numbers that a flight's page opens with, those that are available."""
    found = []
    for name, text in (("position_rmse", "position error, RMS"), ("position_max", "largest position error")):
        value = getattr(metrics, name)
        if value is not None:
            found.append((f"{value:.3g} m" if value >= 0.1 else f"{1000.0 * value:.3g} mm", text))
    if metrics.attitude_rmse is not None:
        found.append((f"{math.degrees(metrics.attitude_rmse):.3g}°", "attitude error, RMS"))
    return found


def _case(
    runs: Sequence[Run], figures: Sequence[Figure], limits: Mapping[str, float] | None = None
) -> list[Figure | str]:
    trajectory = runs[0].trajectory
    title = CASES.get(trajectory, f"Trajectory {trajectory}" if trajectory else "The flight")
    before = any(run.has("reference", "truth") and run.times("truth")[0] < 0.0 for run in runs)
    hidden = before and any(figure.span for figure in figures)
    note = "t = 0 is the start of the trajectory." if before else "t = 0 is the start of the flight."
    note += " Double-click a figure to see what was flown before it." if hidden else ""
    names, values = [run.name for run in runs], [run.metrics for run in runs]
    chosen = {*_METRICS, *(limits or {})}
    head, *main = metric_rows(names, values, limits or {}, chosen)
    _, *others = metric_rows(names, values, limits or {}, METRICS.keys() - chosen)
    return [
        heading(title, note),
        table(head, main),
        folded("More metrics", table(head, others)),
        *with_bands(figures, runs),
    ]


def _flown_with(flights: Sequence[Flight], names: Sequence[str]) -> list[str]:
    meanings = "\n".join(f"{name}: {about.meaning}" for name, about in METRICS.items())
    parts = [heading("Parameters, versions and events"), folded("What the metrics mean", verbatim(meanings))]
    for flight, name in zip(flights, names, strict=True):
        if flight.has("flight/events"):
            head = ("t of flight [s]", "severity", "node", "kind", "text")
            rows = [
                (f"{row['stamp_ns'] * 1e-9:.3f}", *(str(row[key]) for key in head[1:]))
                for row in text_table(flight, "flight/events")
            ]
            parts.append(folded(f"{name}: events", table(head, rows)))
        texts = {}
        if flight.has("flight/parameters"):
            newest = {str(row["node"]): str(row["parameters"]) for row in text_table(flight, "flight/parameters")}
            texts.update({f"{node} as flown": text for node, text in sorted(newest.items())})
        texts["what the recorder noted"] = "\n".join(f"{key}: {each}" for key, each in sorted(flight.metadata.items()))
        parts += [folded(f"{name}: {what}", verbatim(text)) for what, text in texts.items() if text]
    return parts
