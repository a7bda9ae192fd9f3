"""What a flight was, read from its bag alone."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from quad_flight_log.analysis.flight_checks import ends_early, failed_checks
from quad_flight_log.analysis.frames import measured
from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.analysis.tables import truth_note
from quad_flight_log.bag.reader import Flight, open_flight
from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.text import judged, table

STATES = {0: "waiting", 1: "flying", 2: "ended", 3: "failed"}
ENDED = 2


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
        state, reason, flight_time, wall_time = _last_state(flight)
        metrics, note, safety = measured(flight), truth_note(flight), failed_checks(flight)
    except FlightLogError as error:
        return Report("unknown", 0.0, 0.0, FlightMetrics(), limits, [f"no readable bag: {error}"])
    problems = []
    if state != STATES[ENDED] and not (safety and ends_early(flight)):
        problems.append(reason or f"the flight did not end: flight/state is {state}")
    problems += safety
    if flight.truncated:
        problems.append(f"the bag was not closed: {flight.damage}")
    for verdict in judged(metrics, limits):
        if not verdict.met:
            found = "not available" if verdict.value is None else f"{verdict.value:.4g}"
            unit = METRICS[verdict.metric].unit
            problems.append(f"{verdict.metric}: found {found}, expected at most {verdict.limit:g} {unit}")
    factor = flight_time / wall_time if wall_time > 0.0 else 0.0
    return Report(state, flight_time, factor, metrics, limits, problems, note, ends_early(flight))


def text(name: str, seed: int, found: Report) -> str:
    """Return the table for people."""
    rows = table([name], [found.metrics], found.limits, notes=[found.note])
    return "\n".join(
        [
            rows,
            f"seed {seed}; {found.flight_time:.2f} s flown at {found.real_time_factor:.2f} x real time; {found.state}",
        ]
    )


def _last_state(flight: Flight) -> tuple[str, str, float, float]:
    if not flight.has("flight/state"):
        return "unknown", "", 0.0, 0.0
    rows = flight.array("flight/state")
    if len(rows) == 0:
        return "unknown", "", 0.0, 0.0
    last = rows[-1]
    state = STATES.get(int(last["state"]), "unknown")
    return state, str(last["reason"]), float(last["stamp_ns"]) * 1e-9, float(last["wall_time"])
