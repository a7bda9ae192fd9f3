"""Reports of one flight and of several side by side."""

import math
from collections.abc import Mapping, Sequence
from itertools import groupby

from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.analysis.tables import text_table, truth_note
from quad_flight_log.bag.reader import Flight
from quad_flight_log.report.figures import Figure, Table
from quad_flight_log.report.html_page import Page, Section, metric_table
from quad_flight_log.report.inside_figures import inside_figures
from quad_flight_log.report.paper_figures import CASES, paper_figures
from quad_flight_log.report.run import Run, run_from_flight, with_bands
from quad_flight_log.report.verdict import judgement

_METRICS = ("duration", "position_rmse", "position_max", "position_final", "settling_time", "attitude_rmse")
_FACTS = (
    "run_id",
    "outcome",
    "reason",
    "seed",
    "mode",
    "steps",
    "real_time_factor",
    "started",
    "git_commit",
    "command",
)


def names_of(flights: Sequence[Flight]) -> list[str]:
    """Return a short name for each flight, all different: the bag's folder, numbered where two are alike."""
    short = [flight.name for flight in flights]
    found: list[str] = []
    for name in short:
        nth = 1 + sum(other == name or other.startswith(f"{name} (") for other in found)
        found.append(name if nth == 1 else f"{name} ({nth})")
    return found


def flight_page(flight: Flight, name: str, command: str, limits: Mapping[str, float] | None = None) -> Page:
    """Return the report of one flight: verdict, figures, insides, metrics, events, parameters.

    ``limits``: what to hold it to instead of the limits that the bag notes.
    """
    run = run_from_flight(flight, name)
    judged = judgement(flight, run.metrics, limits)
    facts = [("bag", str(flight.path))] + [(key, flight.metadata[key]) for key in _FACTS if flight.metadata.get(key)]
    if flight.truncated:
        facts.insert(0, ("damage", f"the bag is truncated, this is its readable part: {flight.damage}"))
    path = [figure for figure in paper_figures([run]) if figure.spatial]
    sections = [
        Section("", truth_note(flight), tuple(path)),
        *_case_sections([run], judged.limits, spatial=False),
        Section("Inside the flight", figures=tuple(with_bands(inside_figures([run]), [run]))),
        _flown_with([flight], [name]),
    ]
    title, verdict = f"Flight {name}", (judged.good, judged.text)
    return Page(title, command, tuple(facts), tuple(sections), verdict, _numbers(run.metrics))


def comparison_page(flights: Sequence[Flight], names: Sequence[str], command: str) -> Page:
    """Return the report of several flights: one set of figures for each trajectory, all flights in them."""
    runs = [run_from_flight(flight, name) for flight, name in zip(flights, names, strict=True)]
    facts = tuple(
        (name, "; ".join(filter(None, (str(flight.path), truth_note(flight)))))
        for flight, name in zip(flights, names, strict=True)
    )
    sections = _case_sections(runs)
    for trajectory, group in by_trajectory(runs):
        title = f"Inside the flights{f' of {trajectory}' if trajectory else ''}"
        sections.append(Section(title, figures=tuple(with_bands(inside_figures(group), group))))
    sections.append(_flown_with(flights, names))
    return Page(f"Comparison of {', '.join(names)}", command, facts, tuple(sections))


def flight_figures(runs: Sequence[Run]) -> list[Figure]:
    """Return all figures of the runs: the paper's and what went on inside, for each trajectory."""
    found: list[Figure] = []
    for _, group in by_trajectory(runs):
        found += with_bands([*paper_figures(group), *inside_figures(group)], group)
    return found


def by_trajectory(runs: Sequence[Run]) -> list[tuple[str, list[Run]]]:
    """Return the runs grouped by trajectory, in the order of their first appearance."""
    order = list(dict.fromkeys(run.trajectory for run in runs))
    ranked = sorted(runs, key=lambda run: order.index(run.trajectory))
    return [(name, list(group)) for name, group in groupby(ranked, key=lambda run: run.trajectory)]


def _numbers(metrics: FlightMetrics) -> tuple[tuple[str, str], ...]:
    """Return the three numbers that a flight's page opens with, those that are available."""
    found = []
    for name, text in (("position_rmse", "position error, RMS"), ("position_max", "largest position error")):
        value = getattr(metrics, name)
        if value is not None:
            found.append((f"{value:.3g} m" if value >= 0.1 else f"{1000.0 * value:.3g} mm", text))
    if metrics.attitude_rmse is not None:
        found.append((f"{math.degrees(metrics.attitude_rmse):.3g}°", "attitude error, RMS"))
    return tuple(found)


def _case_sections(
    runs: Sequence[Run], limits: Mapping[str, float] | None = None, *, spatial: bool = True
) -> list[Section]:
    sections = []
    for trajectory, group in by_trajectory(runs):
        title = CASES.get(trajectory, f"Trajectory {trajectory}" if trajectory else "The flight")
        note = "t = 0 is the start of the trajectory; double-click a figure to see the approach before it."
        figures = [figure for figure in paper_figures(group) if spatial or not figure.spatial]
        names, values = [run.name for run in group], [run.metrics for run in group]
        chosen = {*_METRICS, *(limits or {})}
        main = metric_table(names, values, "Metrics", limits, chosen)
        others = metric_table(names, values, "More metrics", limits, METRICS.keys() - chosen)
        sections.append(Section(title, note, tuple(with_bands(figures, group)), (main,), more=(others,)))
    return sections


def _flown_with(flights: Sequence[Flight], names: Sequence[str]) -> Section:
    meanings = "\n".join(f"{name}: {about.meaning}" for name, about in METRICS.items())
    folded = [("What the metrics mean", meanings)]
    tables = []
    for flight, name in zip(flights, names, strict=True):
        if flight.parameters_text:
            folded.append((f"{name}: parameter file", flight.parameters_text))
        folded += _resolved(flight, name)
        noted = "\n".join(f"{key}: {value}" for key, value in sorted(flight.metadata.items()))
        folded.append((f"{name}: what the recorder noted", noted))
        if flight.has("flight/events"):
            tables.append(_events(flight, name))
    return Section("Parameters, versions and events", tables=tuple(tables), folded=tuple(folded))


def _resolved(flight: Flight, name: str) -> list[tuple[str, str]]:
    if not flight.has("flight/parameters"):
        return []
    table = text_table(flight, "flight/parameters")
    newest = {str(row["node"]): str(row["parameters"]) for row in table}
    return [(f"{name}: {node} as flown", text) for node, text in sorted(newest.items())]


def _events(flight: Flight, name: str) -> Table:
    table = text_table(flight, "flight/events")
    rows = tuple(
        (f"{row['stamp_ns'] * 1e-9:.3f}", str(row["severity"]), str(row["node"]), str(row["kind"]), str(row["text"]))
        for row in table
    )
    return Table(f"Events of {name}", ("t of flight [s]", "severity", "node", "kind", "text"), rows)
