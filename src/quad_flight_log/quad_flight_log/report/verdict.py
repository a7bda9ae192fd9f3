"""What a report opens with: whether the flight counts, and the limits that it was held to."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from quad_flight_log.analysis.flight_checks import failed_checks
from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.bag.reader import Flight
from quad_flight_log.recorder.provenance import LIMIT
from quad_flight_log.report.text import judged


class Judgement(NamedTuple):
    """What speaks against a flight, one line each, and the limits {metric: largest value} that it was held to."""

    problems: tuple[str, ...]
    limits: Mapping[str, float]

    @property
    def good(self) -> bool:
        """Whether the flight counts."""
        return not self.problems

    @property
    def text(self) -> str:
        """The judgement in one line."""
        if self.problems:
            return "Failed: " + "; ".join(self.problems)
        limits = (f"{name} at most {limit:g} {METRICS[name].unit}".rstrip() for name, limit in self.limits.items())
        listed = ", ".join(limits)
        if not listed:
            return "Ended as planned, held to no limits"
        return f"Good: ended as planned, within its limits ({listed})"


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
        problems.append(reason or f"the flight did not end as planned: {outcome}")
    problems += failed_checks(flight)
    for verdict in judged(metrics, limits_used):
        if not verdict.met:
            found = "not available" if verdict.value is None else f"{verdict.value:.4g}"
            unit = METRICS[verdict.metric].unit
            problems.append(f"{verdict.metric}: found {found}, expected at most {verdict.limit:g} {unit}")
    return Judgement(tuple(problems), limits_used)
