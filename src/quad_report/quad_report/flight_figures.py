"""The figures of flights: the paper's section 4 (Figures 5 to 18), what went on inside laws and vehicle, the playback.

The viewer (``viewer.js``) plays sampled columns of single precision.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_analysis.arrays import Floats, by_stamp, euler_angles, matched, norms, wrapped
from quad_analysis.metrics import FlightMetrics, flight_metrics, hold_times, in_mission, thrust_and_torque
from quad_analysis.tables import TOPICS, Takeover, flight_tables, takeovers, text_table
from quad_core.cascade import COMMAND
from quad_core.enumerations import ON_GROUND
from quad_flight_log.reader import Flight
from quad_report.figures import REFERENCE, Band, Figure, Line, Panel

CASES = {"case1": "Case 1: rectangle (Eqs. 61-64)", "case2": "Case 2: helix (Eqs. 65-68)"}
FIRST_FIGURE = {"case1": 5, "case2": 12}
MOTIONS = (("longitudinal", "x"), ("lateral", "y"), ("vertical", "z"))
ANGLES = (("roll", "φ"), ("pitch", "θ"), ("yaw", "ψ"))
_SHADES = (0.07, 0.16)  # of modes that follow each other
_MODE_COLOUR = "#4f86b8"  # unlike that of a takeover
_PLACES = "Above: position and reference. Below: flown minus reference (Eq. 18)."
_ANGLES = (
    "Above: the angle, and broad and pale what the position law of the same flight asked for (Eq. 38). "
    "Below: flown minus wanted (Eq. 40)."
)
_SEGMENT = 4.0  # s of a spectrum: lines 0.25 Hz apart
_POSITION, _ATTITUDE = "position_controller/internals", "attitude_controller/internals"
_ESTIMATED = "Disturbance (Eqs. 10-12), broad and pale, and the position law's estimate"
_LAWS: tuple[tuple[str, str, str, str, str, str], ...] = (
    ("adaptive-gains", "Adaptive gains (Eq. 37)", "ξ̂{} [1/s]", "xyz", _POSITION, "adaptive_gain"),
    ("sliding", "Sliding variables (Eq. 45)", "s{} [rad/s]", "φθψ", _ATTITUDE, "sliding_variable"),
    ("adaptive-constants", "Adaptive constants (Eq. 54)", "Q̂1{}", "φθψ", _ATTITUDE, "adaptive_constant"),
    ("disturbance", _ESTIMATED, "D{} [m/s²]", "xyz", "disturbance", "lumped_acceleration_w"),
    ("disturbance", _ESTIMATED, "D{} [m/s²]", "xyz", _POSITION, "disturbance_estimate"),
    ("wind", "Wind", "wind {} [m/s]", "xyz", "disturbance", "wind_w"),
    ("rotors", "Rotor speeds", "ω{} [rad/s]", "1234", "actuation", "rotor_speed"),
)
"""(key, title, label of a panel, its axes, topic, field); rows of one key share a figure."""


@dataclass(frozen=True)
class Run:
    """A flight to be drawn. ``name`` is shown, ``trajectory``: what it flew; ``tables``: sorted arrays by topic.

    ``takeovers``: when the guard flew it.
    """

    name: str
    trajectory: str
    tables: Mapping[str, NDArray[np.void]]
    takeovers: tuple[Takeover, ...] = ()

    def has(self, *topics: str) -> bool:
        """Return whether all ``topics`` have messages."""
        return all(topic in self.tables for topic in topics)

    def times(self, topic: str) -> Floats:
        """Return the times of a topic's rows in s; 0 is the start of the trajectory, or else that of the flight."""
        return self.since_start(self.tables[topic])

    def since_start(self, table: NDArray[np.void]) -> Floats:
        """Return the times of a table's rows in s, as ``times``."""
        return (table["stamp_ns"] - self.start_ns) * 1e-9

    @cached_property
    def start_ns(self) -> int:
        """The stamp at which the trajectory time is 0, in a mission after take-off; 0 where it did not begin."""
        tables = {name: self.tables[name] for name in ("reference", "flight/mode") if name in self.tables}
        for row in in_mission(tables).get("reference", ()):
            if row["trajectory_time"] >= 0.0:
                return int(row["stamp_ns"]) - round(float(row["trajectory_time"]) * 1e9)
        return 0

    @cached_property
    def metrics(self) -> FlightMetrics:
        """The metrics of the flight."""
        return flight_metrics(self.tables)


def run_from_tables(name: str, trajectory: str, tables: Mapping[str, NDArray[Any]]) -> Run:
    """Return a run of arrays by topic, as the loop without ROS gives them; topics without rows are left out."""
    kept = {topic: by_stamp(tables[topic]) for topic in TOPICS if topic in tables and len(tables[topic])}
    return Run(name, trajectory, kept)


def run_from_flight(flight: Flight, name: str) -> Run:
    """Return a run of a bag; what the bag lacks is left out."""
    trajectory = str(text_table(flight, "flight/plan")["trajectory"][0]) if flight.has("flight/plan") else ""
    run = run_from_tables(name, trajectory, flight_tables(flight))
    return replace(run, takeovers=tuple(takeovers(flight)))


def with_bands(figures: Sequence[Figure], runs: Sequence[Run]) -> list[Figure]:
    """Return ``figures`` with the times of takeovers of ``runs`` shaded, and modes if it is one run."""
    bands = list(mode_bands(runs[0])) if len(runs) == 1 else []
    for run in runs:
        prefix = f"{run.name}: " if len(runs) > 1 else ""
        for one in run.takeovers:
            begin, end = ((stamp - run.start_ns) * 1e-9 for stamp in (one.begin_ns, one.end_ns))
            bands.append(Band(begin, end, f"{prefix}guard in {one.mode}"))
    return [figure._replace(bands=tuple(bands)) if figure.over_time else figure for figure in figures]


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
        if table["mode"][at] not in ON_GROUND
    )


Curve = tuple[str, str, Floats, Floats, bool]
"""What a line is shown and hidden with, its label, times (n,), values (n, k) in k panels, whether it was wanted."""


def _panels(labels: Sequence[str], curves: Sequence[Curve], *, logarithmic: bool = False) -> tuple[Panel, ...]:
    """Return a panel per label, with a line of every curve in it."""
    return tuple(
        Panel(
            label,
            tuple(Line(run, name, (times, values[:, at]), wanted) for run, name, times, values, wanted in curves),
            logarithmic=logarithmic,
        )
        for at, label in enumerate(labels)
    )


def paper_figures(runs: Sequence[Run]) -> list[Figure]:
    """Return six figures of one case over time, for runs of one trajectory; what the bags do not hold is left out.

    The paper's first of each case, the path, is the viewer's (``scene``).
    """
    flown, turns, turned = [run for run in runs if run.has("truth")], list[Curve](), list[Curve]()
    places = [(run.name, run.name, run.times("truth"), run.tables["truth"]["p_w"], False) for run in flown]
    places += _references(flown)
    off = [(run.name, run.name, *position_error(run), False) for run in flown if run.has("reference")]
    for run in flown:
        angles = np.unwrap(euler_angles(run.tables["truth"]["q_wb"]), axis=0)
        turns.append((run.name, run.name, run.times("truth"), angles, False))
        if run.has("attitude_setpoint"):
            wanted = np.unwrap(run.tables["attitude_setpoint"]["angles"], axis=0)
            turns.append((run.name, f"{run.name}: wanted", run.times("attitude_setpoint"), wanted, True))
            turned.append((run.name, run.name, *attitude_error(run), False))
    found = list[Figure]()
    for axes, unit, what, about, values, errors in (
        (MOTIONS, "m", "translational motion", _PLACES, places, off),
        (ANGLES, "rad", "angle", _ANGLES, turns, turned),
    ):
        above = _panels([f"{letter} [{unit}]" for _, letter in axes], values)
        below = _panels([f"{letter} error [{unit}]" for _, letter in axes], errors)
        for (name, letter), *panels in zip(axes, above, below, strict=True):
            title = f"{name.capitalize()} {what} tracking"
            key, title = numbered(runs[0].trajectory, len(found) + 1, letter if unit == "m" else name, title)
            found.append(Figure(key, title, about, tuple(panels), span=span_of(flown)))
    return _with_lines(found)


def numbered(trajectory: str, at: int, key: str, title: str) -> tuple[str, str]:
    """Return key and title of a case's figure ``at``, with the paper's number where it has one."""
    key, first = f"{trajectory or 'flight'}-{key}", FIRST_FIGURE.get(trajectory)
    return (key, title) if first is None else (f"figure-{first + at:02d}-{key}", f"Figure {first + at}. {title}")


def _with_lines(figures: Sequence[Figure]) -> list[Figure]:
    """Return figures without the panels that no flight has a line in, and none without a panel."""
    kept = (figure._replace(panels=tuple(panel for panel in figure.panels if panel.lines)) for figure in figures)
    return [figure for figure in kept if figure.panels]


def position_error(run: Run) -> tuple[Floats, Floats]:
    """Return times (n,) in s and e_7, e_9, e_11 = flown minus reference (n, 3) in m (Eq. 18), where both are."""
    truth, reference = matched(run.tables["truth"], run.tables["reference"])
    return run.since_start(truth), truth["p_w"] - reference["p_w"]


def attitude_error(run: Run) -> tuple[Floats, Floats]:
    """Return times (n,) in s and phi, theta, psi flown minus wanted (n, 3) in rad, wrapped (Eq. 40)."""
    truth, wanted = matched(run.tables["truth"], run.tables["attitude_setpoint"])
    return run.since_start(truth), wrapped(euler_angles(truth["q_wb"]) - wanted["angles"])


def _references(runs: Sequence[Run]) -> list[Curve]:
    """Return each different reference once, one that all runs share under a name of its own."""
    different: dict[tuple[bytes, ...], Run] = {}
    for run in (each for each in runs if each.has("reference")):
        table = run.tables["reference"]
        different.setdefault(tuple(table[name].tobytes() for name in ("trajectory_time", "p_w", "yaw")), run)
    return [
        (
            *((REFERENCE, "the reference") if len(different) == 1 else (run.name, f"{run.name}: reference")),
            run.times("reference"),
            run.tables["reference"]["p_w"],
            True,
        )
        for run in different.values()
    ]


def span_of(runs: Sequence[Run]) -> tuple[float, float] | None:
    """Return from the trajectory's start to the end of the longest flight; None (all) of flights with modes."""
    runs = [run for run in runs if run.has("truth")]
    if not runs or not all(run.has("reference") for run in runs) or any(run.has("flight/mode") for run in runs):
        return None
    end = max(float(run.times("truth")[-1]) for run in runs)
    return (0.0, round(end, 1)) if end >= 0.1 else None


def inside_figures(runs: Sequence[Run]) -> list[Figure]:
    """Return error, thrust, torque, effort, spectrum and the laws' own quantities of runs of one trajectory."""
    error, thrust, torque = list[Curve](), list[Curve](), list[Curve]()
    for run in runs:
        if run.has("truth", "reference"):
            times, offset = position_error(run)
            error.append((run.name, run.name, times, norms(offset)[:, None], False))
        if run.has(COMMAND):
            force, moments = thrust_and_torque(run.tables[COMMAND])
            thrust.append((run.name, f"{run.name}: commanded", run.times(COMMAND), force[:, None], True))
            torque.append((run.name, run.name, run.times(COMMAND), moments, False))
        if run.has("actuation"):
            achieved = run.tables["actuation"]["thrust"][:, None]
            thrust.append((run.name, f"{run.name}: achieved", run.times("actuation"), achieved, False))
    torques = _panels([f"τ{axis} [N m]" for axis in "xyz"], torque)
    figures = [
        Figure("error", "Distance from the reference", "", _panels(["distance [m]"], error)),
        Figure("thrust", "Thrust along body z (Eq. 38)", "", _panels(["thrust [N]"], thrust)),
        Figure("torque", "Commanded torque about the body axes (Eq. 56)", "", torques),
        *_effort_figures([run for run in runs if run.has(COMMAND)]),
        *_law_figures(runs),
    ]
    prefix, span = runs[0].trajectory or "flight", span_of(runs)
    return [
        figure._replace(key=f"{prefix}-{figure.key}", span=span if figure.over_time else None)
        for figure in _with_lines(figures)
    ]


def _effort_figures(runs: Sequence[Run]) -> list[Figure]:
    """Return the running effort of the commands, and the spectrum of the commanded torque."""
    from scipy.signal import welch

    efforts, spectra = list[Curve](), list[Curve]()
    for run in runs:
        wrench = run.tables[COMMAND][run.times(COMMAND) >= 0.0]
        if len(wrench) < 2:
            continue
        (force, moments), hold = thrust_and_torque(wrench), hold_times(wrench["stamp_ns"])
        squares = np.column_stack([hold * force * force, hold * (moments * moments).sum(axis=1)])
        efforts.append((run.name, run.name, run.since_start(wrench), np.cumsum(squares, axis=0), False))
        known, power = welch(moments, 1.0 / hold[0], nperseg=min(len(hold), round(_SEGMENT / hold[0])), axis=0)
        spectra.append((run.name, run.name, known[1:], power[1:], False))
    effort = _panels(["thrust effort [N² s]", "torque effort [N² m² s]"], efforts)
    powers = _panels([f"τ{axis} [N² m²/Hz]" for axis in "xyz"], spectra, logarithmic=True)
    about = f"Power spectral density from t = 0 on (Welch, segments of {_SEGMENT:g} s)."
    title = "Spectrum of the commanded torque"
    return [
        Figure("effort", "Effort: integral of the squared command", "", effort),
        Figure("spectrum", title, about, powers, "frequency [Hz]", logarithmic=True),
    ]


def _law_figures(runs: Sequence[Run]) -> list[Figure]:
    """Return the figures of _LAWS; a field that a law or a bag lacks, so that it is 0 all along, gives no line."""
    curves: dict[str, list[Curve]] = {}
    for key, _, _, axes, topic, field in _LAWS:
        for run in (each for each in runs if each.has(topic)):
            table, true = run.tables[topic], field == "lumped_acceleration_w"
            if field in (table.dtype.names or ()) and table[field].shape[1:] == (len(axes),) and table[field].any():
                line = (run.name, run.name + ": true" * true, run.times(topic), table[field], true)
                curves.setdefault(key, []).append(line)
    return [
        Figure(key, title, "", _panels([label.format(axis) for axis in axes], curves.get(key, ())))
        for key, (title, label, axes) in {key: about for key, *about, _, _ in _LAWS}.items()
    ]


SAMPLES = 3000  # of one flight, evenly spaced; between them the viewer interpolates


class Playback(NamedTuple):
    """The viewer in a page: flights of one trajectory, the first in full, the others as ghosts."""

    key: str
    title: str
    caption: str
    runs: Sequence[Run]


def playback(runs: Sequence[Run]) -> list[Playback]:
    """Return the playback of those of ``runs`` that have ``truth``: one, or none."""
    flown = [run for run in runs if run.has("truth")]
    if not flown:
        return []
    key, title = numbered(flown[0].trajectory, 0, "path", "3-D position trajectory tracking")
    parts = ["The vehicle is drawn larger than it is; its thrust orange, the wind blue, the reference grey."]
    parts += [f"{flown[0].name}: its path by its error."] if flown[0].has("reference") else []
    parts += [f"Ghosts: {', '.join(run.name for run in flown[1:])}."] if len(flown) > 1 else []
    return [Playback(key, title, " ".join([*parts, "Keys: space, arrows, 1 to 4."]), flown)]


def scene(runs: Sequence[Run], colour: Mapping[str, str]) -> dict[str, Any]:
    """Return what the viewer needs of flights that have ``truth``, the first one in full, the others as ghosts."""
    flights: list[dict[str, Any]] = []
    for run in (each for each in runs if each.has("truth")):
        columns = {name: _packed(values) for name, values in samples(run).items()}
        own = not _same_reference(run, runs[0])
        flights.append({"name": run.name, "colour": colour[run.name], "ownReference": own, **columns})
    return {"flights": flights}


def samples(run: Run, count: int = SAMPLES) -> dict[str, Floats]:
    """Return at most ``count`` samples: t (n,) in s, p (n, 3) in m, q (n, 4), and where recorded more.

    That is thrust (n,) in N, reference (n, 3) in m, NaN before and after it, and wind (n, 3) in m/s.
    """
    truth = run.tables["truth"]
    rows = np.linspace(0, len(truth) - 1, min(len(truth), count)).astype(int)
    times = run.times("truth")[rows]
    found: dict[str, Floats] = {"t": times, "p": truth["p_w"][rows], "q": truth["q_wb"][rows]}
    if run.has("actuation"):
        found["thrust"] = np.interp(times, run.times("actuation"), run.tables["actuation"]["thrust"])
    elif run.has(COMMAND):
        found["thrust"] = np.interp(times, run.times(COMMAND), thrust_and_torque(run.tables[COMMAND])[0])
    if run.has("reference"):
        known = run.times("reference")
        found["reference"] = _columns(times, known, run.tables["reference"]["p_w"])
        found["reference"][(times < known[0]) | (times > known[-1])] = np.nan
    if run.has("disturbance") and "wind_w" in (run.tables["disturbance"].dtype.names or ()):
        wind = _columns(times, run.times("disturbance"), run.tables["disturbance"]["wind_w"])
        found |= {"wind": wind} if wind.any() else {}
    return found


def _columns(times: Floats, known: Floats, values: Floats) -> Floats:
    """Return (n, 3) values at ``times`` of those known at others."""
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)


def _packed(values: Floats) -> str:
    largest = np.finfo(np.float32).max
    return base64.b64encode(np.clip(values, -largest, largest).astype("<f4").tobytes()).decode("ascii")


def _same_reference(run: Run, other: Run) -> bool:
    tables = [each.tables["reference"]["p_w"] for each in (run, other) if each.has("reference")]
    return len(tables) < 2 or (tables[0].shape == tables[1].shape and bool((tables[0] == tables[1]).all()))
