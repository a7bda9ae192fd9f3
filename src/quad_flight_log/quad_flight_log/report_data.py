"""One flight as the figures need it: its tables, its own clock, and what it was flown with."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.arrays import Floats, aligned, by_stamp, euler_angles, wrapped
from quad_flight_log.metrics import FlightMetrics, flight_metrics
from quad_flight_log.reader import Flight

TOPICS = (
    "truth",
    "reference",
    "attitude_setpoint",
    "wrench_setpoint",
    "actuation",
    "disturbance",
    "position_controller/internals",
    "attitude_controller/internals",
)


class Run(NamedTuple):
    """A flight to be drawn. ``name`` is shown, ``trajectory`` groups runs; ``tables``: sorted arrays by topic."""

    name: str
    trajectory: str
    tables: Mapping[str, NDArray[np.void]]

    def has(self, *topics: str) -> bool:
        """Return whether all ``topics`` have messages."""
        return all(topic in self.tables for topic in topics)

    def times(self, topic: str) -> Floats:
        """Return the times of a topic's rows in s on the clock of the trajectory (0: its start; else of the flight)."""
        return (self.tables[topic]["stamp_ns"] - self.start_ns) * 1e-9

    @property
    def start_ns(self) -> int:
        """The stamp at which the trajectory time is 0."""
        if "reference" not in self.tables:
            return 0
        first = self.tables["reference"][0]
        return int(first["stamp_ns"]) - round(float(first["trajectory_time"]) * 1e9)

    @property
    def metrics(self) -> FlightMetrics:
        """The metrics of the flight."""
        return flight_metrics(self.tables)


def run_from_tables(name: str, trajectory: str, tables: Mapping[str, NDArray[Any]]) -> Run:
    """Return a run of arrays by topic, as the ROS-free loop gives them; topics without rows are left out."""
    kept = {topic: by_stamp(tables[topic]) for topic in TOPICS if topic in tables and len(tables[topic])}
    return Run(name, trajectory, kept)


def run_from_flight(flight: Flight, name: str) -> Run:
    """Return a run of a bag; what the bag has not is left out."""
    tables = flight.arrays(*(topic for topic in TOPICS if flight.has(topic)))
    return run_from_tables(name, trajectory_of(flight), tables)


def trajectory_of(flight: Flight) -> str:
    """Return the name of the trajectory that was flown, empty where the bag does not tell."""
    if not flight.has("flight/plan"):
        return ""
    return str(flight.array("flight/plan")["trajectory"][0])


def position_error(run: Run) -> tuple[Floats, Floats]:
    """Return times (n,) in s and e_7, e_9, e_11 = flown minus reference (n, 3) in m (Eq. 18), where both are."""
    truth, reference = run.tables["truth"], run.tables["reference"]
    match = aligned(truth["stamp_ns"], reference["stamp_ns"])
    return run.times("reference")[match.right], truth["p_w"][match.left] - reference["p_w"][match.right]


def attitude_error(run: Run) -> tuple[Floats, Floats]:
    """Return times (n,) in s and phi, theta, psi flown minus wanted (n, 3) in rad, wrapped (Eq. 40)."""
    truth, wanted = run.tables["truth"], run.tables["attitude_setpoint"]
    match = aligned(truth["stamp_ns"], wanted["stamp_ns"])
    error = wrapped(euler_angles(truth["q_wb"][match.left]) - wanted["angles"][match.right])
    return run.times("attitude_setpoint")[match.right], error


def same_reference(first: Run, second: Run) -> bool:
    """Return whether two runs were given the same reference on the same clock."""
    if not (first.has("reference") and second.has("reference")):
        return False
    one, other = first.tables["reference"], second.tables["reference"]
    return all(np.array_equal(one[field], other[field]) for field in ("trajectory_time", "p_w", "yaw"))
