"""The report of one flight, or of several in the same figures."""

import math
from collections.abc import Mapping, Sequence

from quad_flight_log.analysis.flight_checks import judgement
from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.analysis.tables import text_table, truth_note
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.figures import Figure
from quad_flight_log.report.flight_figures import CASES, Run, inside_figures, paper_figures, run_from_flight, with_bands
from quad_flight_log.report.page import Page, folded, heading, table, verbatim
from quad_flight_log.report.scene import Playback, playback
from quad_flight_log.report.text import metric_rows

_METRICS = ("duration", "position_rmse", "position_max", "position_final", "settling_time", "attitude_rmse")


def report_page(flights: Sequence[Flight], names: Sequence[str], command: str) -> Page:
    """Return the report of one flight, or of several of one trajectory in the same figures.

    Each is judged by the limits that its bag notes; the page opens with the worst verdict. Then come of one flight
    three numbers and its playback, of several the table with the best, the error over time and the playback. Raises
    TopicError for a bag without any topic of a flight, FlightLogError for different trajectories.
    """
    runs = runs_of_one_trajectory(flights, names)
    for flight, run in zip(flights, runs, strict=True):
        if not run.tables:
            raise flight.without_topics("there is nothing to report")
    judged = [judgement(flight, run.metrics) for flight, run in zip(flights, runs, strict=True)]
    notes = {name: truth_note(flight) for flight, name in zip(flights, names, strict=True)}
    body: list[Figure | Playback | str] = [heading("", f"{name}: {note}") for name, note in notes.items() if note]
    tables = _tables(runs, judged[0].limits if len(runs) == 1 else {})
    inside = with_bands(inside_figures(runs), runs)
    error = [figure for figure in inside if figure.key.endswith("-error")]
    others = [figure for figure in inside if not figure.key.endswith("-error")]
    body += [*playback(runs), *tables, *error] if len(runs) == 1 else [*tables, *error, *playback(runs)]
    trajectory = runs[0].trajectory
    body += [heading("The paper's figures" if trajectory in CASES else "Position and attitude")]
    body += with_bands(paper_figures(runs), runs)
    body += [heading("Inside the flight"), *others, *_flown_with(flights, names)]
    facts = [(name, str(flight.path)) for flight, name in zip(flights, names, strict=True)]
    page = Page(f"Flight{'s' * (len(names) > 1)} {', '.join(names)}", command, facts, body)
    verdict = next(word for word in ("failed", "unknown", "good") if word in [one.verdict for one in judged])
    if len(runs) == 1:
        return page._replace(verdict=(verdict, judged[0].text), numbers=_numbers(runs[0].metrics))
    texts: dict[str, list[str]] = {}
    for name, one in zip(names, judged, strict=True):
        texts.setdefault(one.text, []).append(name)
    text = "; ".join(f"{', '.join(alike)}: {text}" for text, alike in texts.items())
    return page._replace(verdict=(verdict, text))


def runs_of_one_trajectory(flights: Sequence[Flight], names: Sequence[str]) -> list[Run]:
    """Return the runs of flights that flew the same trajectory; raises FlightLogError of others."""
    runs = [run_from_flight(flight, name) for flight, name in zip(flights, names, strict=True)]
    flown = dict.fromkeys(run.trajectory for run in runs)
    if len(flown) > 1:
        raise FlightLogError(f"found flights of {', '.join(map(repr, flown))}, expected one trajectory")
    return runs


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


def _tables(runs: Sequence[Run], limits: Mapping[str, float]) -> list[str]:
    """Return what was flown, and the metrics: those of a first look and of ``limits``, and folded the rest."""
    trajectory = runs[0].trajectory
    title = CASES.get(trajectory, f"Trajectory {trajectory}" if trajectory else "The flight")
    note = "t = 0 is the start of the flight."
    if any(run.has("reference", "truth") and run.times("truth")[0] < 0.0 for run in runs):
        note = "t = 0 is the start of the trajectory. A double click on a figure shows all that was flown."
    names, values = [run.name for run in runs], [run.metrics for run in runs]
    chosen = {*_METRICS, *limits}
    found = []
    for shown in (chosen, METRICS.keys() - chosen):
        head, *rows = metric_rows(names, values, limits, shown)
        found.append(table(head, *_with_differences(rows, values)) if len(runs) > 1 else table(head, rows))
    return [heading(title, note), found[0], folded("More metrics", found[1])]


def _with_differences(
    rows: Sequence[Sequence[str]], values: Sequence[FlightMetrics]
) -> tuple[list[list[str]], set[tuple[int, int]]]:
    """Return the rows with what each value has more than the least of its row in per cent, and where the least are."""
    found, best = [], set()
    for at, (name, *cells) in enumerate(rows):
        numbers = [getattr(each, name) for each in values]
        known = [each for each in numbers if each is not None]
        if name != "duration" and len(set(known)) > 1:
            least = min(known)
            for column, value in enumerate(numbers):
                if value == least:
                    best.add((at, column + 1))
                elif value is not None and least > 0.0:
                    cells[column] += f" (+{100.0 * (value / least - 1.0):.3g} %)"
        found.append([name, *cells])
    return found, best


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
