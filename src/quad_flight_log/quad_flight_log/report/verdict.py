"""What a report opens with: whether the flight counts, and the limits that it was held to."""

from collections.abc import Mapping
from typing import NamedTuple

from quad_flight_log.analysis.flight_checks import failed_checks
from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.bag.reader import Flight
from quad_flight_log.recorder.provenance import LIMIT
from quad_flight_log.report.text import read_limits


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


def judgement(flight: Flight, metrics: FlightMetrics, limits: Mapping[str, float] | None = None) -> Judgement:
    """Return the judgement on a flight by ``limits``, by default those that the bag notes; raises LimitsError."""
    noted = [f"{name}={flight.metadata[LIMIT + name]}" for name in METRICS if LIMIT + name in flight.metadata]
    limits_used = read_limits(noted) if limits is None else limits
    problems = [f"the bag is cut ({flight.damage})"] if flight.truncated else []
    outcome = flight.metadata.get("outcome", "unknown")  # a recorder of others notes none
    if outcome not in ("ended", "unknown"):
        problems.append(flight.metadata.get("reason", "") or f"the flight did not end as planned: {outcome}")
    problems += failed_checks(flight)
    for name, limit in limits_used.items():
        value = getattr(metrics, name)
        if value is None or value > limit:
            found = "not available" if value is None else f"{value:.4g}"
            problems.append(f"{name}: found {found}, expected at most {limit:g} {METRICS[name].unit}")
    return Judgement(tuple(problems), limits_used)
