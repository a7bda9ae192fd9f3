"""Logs as identification takes them: a flight of ours, an imported bag, or a file of others by its map."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from quad_analysis.refly import flown_wrench, phases_of
from quad_analysis.tables import PARAMETERS
from quad_core.cascade import COMMAND, POSITION
from quad_core.types import Vec3, Wrench
from quad_core.vehicle import ARRANGEMENTS, Layout, Vehicle
from quad_dynamics.rotors import allocate_within, rotor_limit, rotor_speed
from quad_flight_log.errors import FlightLogError
from quad_flight_log.notes import ROTORS
from quad_flight_log.reader import open_flight
from quad_identify.record import Flight, Floats, RecordError, Samples
from quad_log_import.maps import Recording, load_map, mapped, read_recording
from quad_log_import.tables import read_tables


def read_log(path: Path, map_name: str = "", layout: str = "") -> Flight:
    """Return the log at ``path``; ``layout`` of the motors as the map or the bag says, if it is not given.

    Raises FlightLogError or RecordError naming file, field, found and expected.
    """
    if not path.is_dir() or map_name:
        recording, _ = read_recording(path, map_name)
        return _flight(recording, path.name, layout)
    bag = open_flight(path)
    if bag.has(PARAMETERS) and bag.has(COMMAND) and bag.has("state"):
        vehicle = phases_of(bag, POSITION, None, {})[0][1].vehicle
        stamps, wrench = flown_wrench(bag, vehicle)
        return of_ours(bag.array("state"), 1e-9 * stamps.astype(np.float64), wrench, vehicle, path.name)
    return _flight(_imported(path), path.name, layout)


def of_ours(state: Any, times: Floats, wrench: Floats, vehicle: Vehicle, name: str = "log") -> Flight:
    """Return a flight of this stack: table ``state``, ``wrench`` (thrust N, torque N m), (n, 4), sent at ``times`` s.

    A motor's command is the speed that the nominal ``vehicle``'s allocation asks for, over the largest; the specific
    force is the change of velocity from state to state. Samples stand at the times at which they were true.
    """
    t = state["stamp_ns"] * 1e-9
    moved = np.diff(t - state["velocity_age"])
    with np.errstate(divide="ignore", invalid="ignore"):  # a repeated sample: left out as not finite
        change = np.diff(state["v_w"], axis=0) / moved[:, None]
    level = Rotation.from_quat(state["q_wb"])
    middle = level[:-1] * Rotation.from_rotvec(0.5 * (level[:-1].inv() * level[1:]).as_rotvec())
    force = middle.apply(change + np.array([0.0, 0.0, vehicle.gravity]), inverse=True)
    limit = rotor_limit(vehicle)
    made = [
        allocate_within(vehicle, Wrench(thrust, Vec3(*torque)), limit).rotor_speed
        for thrust, *torque in wrench.tolist()
    ]
    return Flight(
        Samples(times, np.array(made) / rotor_speed(vehicle, limit)),
        Samples((t - state["velocity_age"])[:-1] + 0.5 * moved, force),
        Samples(t - state["rate_age"], state["omega_b"]),
        ARRANGEMENTS["x" if vehicle.layout == Layout.X else "plus"],
        velocity=Samples(t - state["velocity_age"], state["v_w"]),
        attitude=Samples(t - state["attitude_age"], state["q_wb"]),
        position=Samples(t - state["position_age"], state["p_w"]),
        name=name,
        differentiated=True,
    )


def _imported(path: Path) -> Recording:
    """Return what an imported bag holds, each signal at its own times."""
    noted = open_flight(path).metadata.get(ROTORS, "x")
    _, tables, notes = read_tables(path)
    imu = tables.get("imu", {})
    for name in ("linear_acceleration", "angular_velocity"):
        known = imu.get(f"{name}_covariance[0]")
        if known is not None:  # -1: without one
            tables[name] = {column: values[known >= 0.0] for column, values in imu.items()}
    content = {**load_map("bag"), ROTORS: noted}
    try:
        return mapped(tables, content, notes)
    except FlightLogError as error:
        raise FlightLogError(f"{path}: {error}") from error


def _flight(recording: Recording, name: str, layout: str) -> Flight:
    signals = {key: Samples(found.t, found.values) for key, found in recording.signals.items()}
    speeds = "motors" not in signals
    motors = signals.get("speeds" if speeds else "motors")
    if motors is None:
        raise RecordError(f"{name}: motors: found none in the log, expected commands or speeds of four motors")
    return Flight(
        motors,
        signals.get("specific_force"),
        signals.get("body_rates"),
        ARRANGEMENTS[layout or recording.rotors],
        speeds,
        signals.get("velocity"),
        signals.get("attitude"),
        signals.get("position"),
        signals.get("voltage"),
        name,
    )


def places(arms: list[float], layout: str) -> tuple[float, float]:
    """Return how far the rotors stand from the centre along x and along y, in m.

    ``arms``: the arm from centre to rotor, or both distances.
    """
    if len(arms) == 2:
        return arms[0], arms[1]
    return (arms[0], arms[0]) if layout == "plus" else (arms[0] * float(np.sqrt(0.5)), arms[0] * float(np.sqrt(0.5)))
