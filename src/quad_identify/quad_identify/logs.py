"""Logs as identification takes them: an imported bag, or a file of others by its map."""

from pathlib import Path

import numpy as np

from quad_core.vehicle import ARRANGEMENTS
from quad_flight_log.bag.reader import open_flight
from quad_flight_log.errors import FlightLogError
from quad_flight_log.imports.importing import read_recording
from quad_flight_log.imports.maps import Recording, load_map, mapped
from quad_flight_log.imports.tables import read_tables
from quad_flight_log.imports.write import ROTORS
from quad_identify.record import Flight, RecordError, Samples


def read_log(path: Path, map_name: str = "", layout: str = "") -> Flight:
    """Return the log at ``path``; ``layout`` of the motors as the map or the bag says, if it is not given.

    Raises FlightLogError or RecordError naming file, field, found and expected.
    """
    if not path.is_dir() or map_name:
        recording, _ = read_recording(path, map_name)
    else:
        recording = _imported(path)
    return _flight(recording, path.name, layout)


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
