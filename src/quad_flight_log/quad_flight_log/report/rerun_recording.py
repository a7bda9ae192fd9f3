"""A flight as a Rerun recording: the vehicle in space with its arrows, and its curves, on one clock.

Entities under ``world`` are in the world frame (ENU, m); below ``world/vehicle`` in the body frame (FLU). The timeline
``flight`` is the time since the start of the flight in s.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.cascade import COMMAND
from quad_flight_log.analysis.arrays import norms
from quad_flight_log.analysis.metrics import thrust_and_torque
from quad_flight_log.errors import FlightLogError
from quad_flight_log.report.figures import Floats, Line, thin
from quad_flight_log.report.interactive_figures import PALETTE, REFERENCE_COLOUR
from quad_flight_log.report.run import Run, attitude_error, position_error
from quad_flight_log.report.vehicle_drawing import ARM, DISTURBANCE_SCALE, ROTORS, THRUST_SCALE, rgb

CURVES = {
    "error": ("x", "y", "z"),
    "attitude": ("roll", "pitch", "yaw"),
    "thrust": ("achieved", "commanded"),
    "sliding": ("roll", "pitch", "yaw"),
}
LIVE_PLOTS = ("error", "thrust")  # what a visitor hears of
TIMELINE = "flight"
APPLICATION = "quad_flight"
POSE_PERIOD = 0.02  # s between two poses in the view
_FLOWN, _THRUST, _WIND, _FORWARD, _TARGET = (rgb(colour) for colour in PALETTE[:5])
_PLANNED = (154, 164, 175)
_AXES, _ANGLES = CURVES["error"], CURVES["attitude"]
PLOTS = {
    "error": "position error [m]",
    "attitude": "attitude error [rad]",
    "thrust": "thrust [N]",
    "sliding": "sliding variables [rad/s]",
}


class Curve(NamedTuple):
    """A scalar over time: entity path, times in s of the flight, values."""

    entity: str
    times: Floats
    values: Floats


def write_recording(run: Run, path: Path, events: Sequence[tuple[float, str]] = ()) -> Path:
    """Write ``run`` as a .rrd file with its own layout; ``events``: (flight time in s, text).

    Raises FlightLogError if rerun is not installed, the file cannot be written, or the run has no ``truth``.
    """
    rr = rerun()
    if not run.has("truth"):
        raise FlightLogError("the view needs the topic 'truth'; the bag has no message of it")
    recording = rr.RecordingStream(APPLICATION, recording_id=run.name)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        recording.save(path, default_blueprint=blueprint(run.tables["truth"]["p_w"]))
    except OSError as error:
        raise FlightLogError(f"{path}: {error.strerror or error}") from error
    log_scene(recording)
    _log_paths(recording, run)
    _log_poses(recording, run)
    for curve in curves(run):
        index = rr.TimeColumn(TIMELINE, duration=curve.times)
        recording.send_columns(curve.entity, [index], rr.Scalars.columns(scalars=curve.values))
    for time, text in events:
        recording.set_time(TIMELINE, duration=time)
        recording.log("events", rr.TextLog(text))
    recording.flush()
    recording.disconnect()
    return path


def rerun() -> Any:
    """Return the module rerun; raises FlightLogError where it is not installed."""
    try:
        import rerun as module
    except ImportError as error:
        raise FlightLogError("the view needs rerun-sdk: pip install -r requirements/extras.txt") from error
    module.set_strict_mode(True)
    return module


def blueprint(points: Floats | None = None) -> Any:
    """Return the layout of the view: space on the left, curves on the right.

    ``points`` (n, 3): the path, which the eye is placed to see as a whole; None for a flight that is still flown: the
    eye is left where the viewer puts it, and the curves show the newest half minute.
    """
    import rerun.blueprint as rrb

    live = points is None
    first = rrb.TimeRangeBoundary.cursor_relative(seconds=-30.0) if live else rrb.TimeRangeBoundary.infinite()
    last = rrb.TimeRangeBoundary.cursor_relative() if live else rrb.TimeRangeBoundary.infinite()
    shown = rrb.TimeAxis(view_range=rrb.TimeRange(first, last))
    plots = [
        rrb.TimeSeriesView(origin=origin, name=name, axis_x=shown, plot_legend=rrb.Corner2D.LeftTop)
        for origin, name in PLOTS.items()
        if origin in LIVE_PLOTS or not live
    ]
    eye = None if points is None else rrb.EyeControls3D(**_eye(points))
    space = rrb.Spatial3DView(origin="world", name="world (ENU, m)", eye_controls=eye)
    return rrb.Blueprint(
        rrb.Horizontal(space, rrb.Vertical(*plots), column_shares=[3, 2]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
    )


def _eye(points: Floats) -> dict[str, Any]:
    low, high = points.min(axis=0), points.max(axis=0)
    centre = 0.5 * (low + high)
    radius = max(2.0, 0.5 * float(norms((high - low)[None, :])[0]))
    return {
        "position": centre + radius * np.array([1.35, -1.35, 0.8]),
        "look_target": centre,
        "eye_up": [0.0, 0.0, 1.0],
    }


def log_scene(recording: Any) -> None:
    """Log what does not move: the frame's convention and the vehicle's shape in its own frame."""
    rr = rerun()
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    arms = [[ROTORS[0], ROTORS[2]], [ROTORS[1], ROTORS[3]]]
    recording.log(
        "world/vehicle/arms", rr.LineStrips3D(arms, colors=rgb(REFERENCE_COLOUR), radii=0.04 * ARM), static=True
    )
    rotors = rr.Points3D(ROTORS, colors=_FLOWN, radii=0.35 * ARM)
    recording.log("world/vehicle/rotors", rotors, static=True)
    front = rr.Arrows3D(vectors=[[1.6 * ARM, 0.0, 0.0]], colors=_FORWARD, radii=0.04 * ARM)
    recording.log("world/vehicle/forward", front, static=True)
    for origin, names in CURVES.items():
        for name, colour in zip(names, PALETTE, strict=False):
            recording.log(f"{origin}/{name}", rr.SeriesLines(colors=rgb(colour), names=name), static=True)


def curves(run: Run) -> list[Curve]:
    """Return the scalars of a run, thinned so that their extremes stay."""
    start = run.start_ns * 1e-9
    found: list[Curve] = []
    if run.has("reference"):
        times, error = position_error(run)
        found += [_curve(f"error/{letter}", times + start, error[:, axis]) for axis, letter in enumerate(_AXES)]
    if run.has("attitude_setpoint"):
        times, error = attitude_error(run)
        found += [_curve(f"attitude/{name}", times + start, error[:, axis]) for axis, name in enumerate(_ANGLES)]
    if run.has(COMMAND):
        thrust, _ = thrust_and_torque(run.tables[COMMAND])
        found.append(_curve("thrust/commanded", run.times(COMMAND) + start, thrust))
    if run.has("actuation"):
        found.append(_curve("thrust/achieved", run.times("actuation") + start, run.tables["actuation"]["thrust"]))
    inside = "attitude_controller/internals"
    if run.has(inside) and "sliding_variable" in (run.tables[inside].dtype.names or ()):
        values, when = run.tables[inside]["sliding_variable"], run.times(inside) + start
        found += [_curve(f"sliding/{name}", when, values[:, axis]) for axis, name in enumerate(_ANGLES)]
    return found


def _curve(entity: str, times: Floats, values: Floats) -> Curve:
    line = thin(Line("", "", (times, values)))
    return Curve(entity, *line.columns)


def _log_paths(recording: Any, run: Run) -> None:
    rr = rerun()
    for entity, topic, colour in (("flown", "truth", _FLOWN), ("reference", "reference", _PLANNED)):
        if run.has(topic):
            points = run.tables[topic]["p_w"]
            kept = thin(Line("", "", (points[:, 0], points[:, 1], points[:, 2])))
            strip = rr.LineStrips3D([np.stack(kept.columns, axis=1)], colors=colour, radii=0.03)
            recording.log(f"world/{entity}", strip, static=True)


def _log_poses(recording: Any, run: Run) -> None:
    rr = rerun()
    truth = run.tables["truth"]
    rows = paced(truth["stamp_ns"], POSE_PERIOD)
    times = truth["stamp_ns"][rows] * 1e-9
    place = truth["p_w"][rows]
    index = rr.TimeColumn(TIMELINE, duration=times)
    poses = rr.Transform3D.columns(translation=place, quaternion=truth["q_wb"][rows])
    recording.send_columns("world/vehicle", [index], poses)
    if run.has("actuation"):
        thrust = held_at(run.tables["actuation"], truth["stamp_ns"][rows])["thrust"]
        arrows = np.stack([0.0 * thrust, 0.0 * thrust, THRUST_SCALE * thrust], axis=1)
        _log_arrows(recording, "world/vehicle/thrust", index, arrows, np.zeros_like(arrows), _THRUST)
    if run.has("disturbance") and "force_w" in (run.tables["disturbance"].dtype.names or ()):
        force = held_at(run.tables["disturbance"], truth["stamp_ns"][rows])["force_w"]
        _log_arrows(recording, "world/disturbance", index, DISTURBANCE_SCALE * force, place, _WIND)
    if run.has("reference"):
        wanted = held_at(run.tables["reference"], truth["stamp_ns"][rows])["p_w"]
        recording.log("world/target", rr.Points3D.from_fields(colors=_TARGET, radii=0.12), static=True)
        recording.send_columns("world/target", [index], rr.Points3D.columns(positions=wanted))


def _log_arrows(recording: Any, entity: str, index: Any, vectors: Floats, origins: Floats, colour: Any) -> None:
    rr = rerun()
    recording.log(entity, rr.Arrows3D.from_fields(colors=colour, radii=0.04), static=True)
    recording.send_columns(entity, [index], rr.Arrows3D.columns(vectors=vectors, origins=origins))


def paced(stamp_ns: NDArray[np.int64], period: float) -> NDArray[np.intp]:
    """Return the indices of the first row in each ``period`` s."""
    slots = stamp_ns // round(period * 1e9)
    _, first = np.unique(slots, return_index=True)
    return first


def held_at(table: NDArray[np.void], stamp_ns: NDArray[np.int64]) -> NDArray[np.void]:
    """Return the rows of a sorted table that hold at ``stamp_ns``: the newest not after it, else the first."""
    rows = np.searchsorted(table["stamp_ns"], stamp_ns, side="right") - 1
    return table[np.maximum(rows, 0)]
