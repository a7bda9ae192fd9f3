"""One flight as the figures need it: its tables, its own clock, and what it was flown with."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.analysis.arrays import Floats, aligned, by_stamp, euler_angles, wrapped
from quad_flight_log.analysis.metrics import FlightMetrics, flight_metrics
from quad_flight_log.analysis.tables import TOPICS, flight_tables, text_table
from quad_flight_log.analysis.takeovers import Exchange, Takeover, exchanges, takeovers
from quad_flight_log.bag.reader import Flight
from quad_flight_log.report.figures import Band, Figure

_ARMING = 1  # of flight/mode
_SHADES = (0.05, 0.14)  # of modes that follow each other
_MODE_COLOUR = "#33658a"  # unlike that of a takeover


class Run(NamedTuple):
    """A flight to be drawn. ``name`` is shown, ``trajectory`` groups runs; ``tables``: sorted arrays by topic.

    ``takeovers``: when the guard flew it. ``exchanges``: when a standby did.
    """

    name: str
    trajectory: str
    tables: Mapping[str, NDArray[np.void]]
    takeovers: tuple[Takeover, ...] = ()
    exchanges: tuple[Exchange, ...] = ()

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
    run = run_from_tables(name, trajectory_of(flight), flight_tables(flight))
    return run._replace(takeovers=tuple(takeovers(flight)), exchanges=tuple(exchanges(flight)))


def takeover_bands(runs: Sequence[Run]) -> tuple[Band, ...]:
    """Return the times in which the guard or a standby flew one of ``runs``, each on its run's own clock in s."""
    return tuple(
        Band(
            (begin - run.start_ns) * 1e-9, (end - run.start_ns) * 1e-9, f"{run.name}: {text}" if len(runs) > 1 else text
        )
        for run in runs
        for begin, end, text in [
            *((one.begin_ns, one.end_ns, f"guard in {one.mode}") for one in run.takeovers),
            *((one.begin_ns, one.end_ns, f"standby {one.role} flies") for one in run.exchanges),
        ]
    )


def mode_bands(run: Run) -> tuple[Band, ...]:
    """Return the modes of a flight with a commander, from TAKEOFF on, shaded in turn; none without `flight/mode`."""
    if not run.has("flight/mode"):
        return ()
    table, times = run.tables["flight/mode"], run.times("flight/mode")
    first = np.flatnonzero(np.r_[True, np.diff(table["mode"].astype(int)) != 0])
    ends = np.append(times[first[1:]], times[-1])
    return tuple(
        Band(float(times[at]), float(end), str(table["name"][at]), _SHADES[place % 2], _MODE_COLOUR)
        for place, (at, end) in enumerate(zip(first, ends, strict=True))
        if table["mode"][at] > _ARMING
    )


def with_bands(figures: Sequence[Figure], runs: Sequence[Run]) -> list[Figure]:
    """Return ``figures`` with the times of takeovers of ``runs`` shaded, and modes if it is one run."""
    bands = (*(mode_bands(runs[0]) if len(runs) == 1 else ()), *takeover_bands(runs))
    return [figure._replace(bands=bands) if figure.over_time else figure for figure in figures]


def trajectory_of(flight: Flight) -> str:
    """Return the name of the trajectory that was flown, empty where the bag does not tell."""
    if not flight.has("flight/plan"):
        return ""
    return str(text_table(flight, "flight/plan")["trajectory"][0])


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
