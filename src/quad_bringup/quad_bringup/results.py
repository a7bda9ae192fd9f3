"""What a flight was, read from its bag alone."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from quad_flight_log.analysis.flight_checks import ends_early
from quad_flight_log.analysis.metrics import FlightMetrics
from quad_flight_log.analysis.tables import measured, truth_note
from quad_flight_log.bag.reader import Flight, open_flight
from quad_flight_log.errors import FlightLogError, TopicError
from quad_flight_log.report.text import table
from quad_flight_log.report.verdict import judgement

STATES = {0: "waiting", 1: "flying", 2: "ended", 3: "failed"}


class Report(NamedTuple):
    """A flight as its bag shows it.

    ``state`` is its last phase; ``problems``: why it failed; ``note``: what is to be known of its metrics;
    ``ends_early``: the bag ends before the flight.
    """

    state: str
    flight_time: float
    real_time_factor: float
    metrics: FlightMetrics
    limits: Mapping[str, float]
    problems: list[str]
    note: str = ""
    ends_early: bool = False


def report(directory: Path, limits: Mapping[str, float], namespace: str = "") -> Report:
    """Return the results of the bag in ``directory``, checked against ``limits`` ({metric: largest value})."""
    try:
        flight = open_flight(directory, namespace=namespace)
        state, flight_time, wall_time = _last_state(flight)
        metrics = _measured(flight)
        problems = judgement(flight, metrics, limits).problems
        note = truth_note(flight)
    except FlightLogError as error:
        return Report("unknown", 0.0, 0.0, FlightMetrics(), limits, [f"no readable bag: {error}"])
    factor = flight_time / wall_time if wall_time > 0.0 else 0.0
    return Report(state, flight_time, factor, metrics, limits, list(problems), note, ends_early(flight))


def _measured(flight: Flight) -> FlightMetrics:
    try:
        return measured(flight)
    except TopicError:  # it never began: its record tells why, and there is nothing to measure
        return FlightMetrics()


def text(name: str, found: Report, about: str) -> str:
    """Return the table for people, left out where nothing could be measured; ``about``: what else the flight was."""
    measured_any = any(value is not None for value in found.metrics)
    rows = table([name], [found.metrics], found.limits, notes=[found.note])
    flown = f"{found.flight_time:.2f} s flown at {found.real_time_factor:.2f} x real time; {found.state}"
    return f"{rows if measured_any else f'{name}: no metrics: {found.note}'}\n{about}; {flown}"


def _last_state(flight: Flight) -> tuple[str, float, float]:
    """Return the last phase, and flight and wall time in s."""
    rows = flight.array("flight/state") if flight.has("flight/state") else None
    if rows is None or len(rows) == 0:
        return "unknown", 0.0, 0.0
    last = rows[-1]
    return STATES.get(int(last["state"]), "unknown"), float(last["stamp_ns"]) * 1e-9, float(last["wall_time"])
