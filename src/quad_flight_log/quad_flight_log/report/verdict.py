"""What a report opens with: whether the flight counts, and the limits that it was held to."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from quad_flight_log.analysis.flight_checks import failed_checks
from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.bag.reader import Flight
from quad_flight_log.recorder.provenance import LIMIT
from quad_flight_log.report.text import judged


class Judgement(NamedTuple):
    """Whether a flight counts, in one line, and the limits {metric: largest value}."""

    good: bool
    text: str
    limits: Mapping[str, float]


def recorded_limits(flight: Flight) -> dict[str, float]:
    """Return the limits that ``fly`` held the flight to, as the recorder noted them; empty where it did not."""
    found = {}
    for name in METRICS:
        try:
            value = float(flight.metadata.get(LIMIT + name, "nan"))
        except ValueError:
            continue
        if math.isfinite(value):
            found[name] = value
    return found


def judgement(flight: Flight, metrics: FlightMetrics, limits: Mapping[str, float] | None = None) -> Judgement:
    """Return the judgement on a flight by ``limits``, by default those that the bag notes."""
    limits_used = recorded_limits(flight) if limits is None else limits
    problems: list[str] = []
    if flight.truncated:
        problems.append(f"the bag is cut ({flight.damage})")
    outcome = flight.metadata.get("outcome", "unknown")
    if outcome != "ended" and not (flight.truncated and outcome == "unknown"):
        reason = flight.metadata.get("reason", "")
        problems.append(f"the flight did not end as planned: {reason or outcome}")
    problems += failed_checks(flight)
    for verdict in judged(metrics, limits_used):
        if not verdict.met:
            value = "not available" if verdict.value is None else f"{verdict.value:.4g}"
            problems.append(f"{verdict.metric} is {value}, limit {verdict.limit:g} {METRICS[verdict.metric].unit}")
    return Judgement(not problems, _text(problems, limits_used), limits_used)


def _text(problems: Sequence[str], limits: Mapping[str, float]) -> str:
    if problems:
        return "Failed: " + "; ".join(problems)
    listed = ", ".join(f"{name} at most {limit:g} {METRICS[name].unit}".rstrip() for name, limit in limits.items())
    return f"Good: ended as planned, within its limits ({listed})" if limits else "Ended as planned, held to no limits"
