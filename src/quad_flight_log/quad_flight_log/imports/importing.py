"""Reads a log of others by its map: what ``log import`` and identification share."""

from pathlib import Path

from quad_flight_log.errors import FlightLogError
from quad_flight_log.imports.maps import DEFAULT, SHIPPED, Recording, load_map, mapped
from quad_flight_log.imports.tables import read_tables


def read_recording(path: Path, map_name: str = "") -> tuple[Recording, str]:
    """Return the log at ``path`` in our units and frames, and the name of the map that was used.

    Raises FlightLogError naming file, what was found and what was expected.
    """
    kind, tables, notes = read_tables(path)
    name = map_name or DEFAULT.get(kind, "")
    if not name:
        raise FlightLogError(f"{path}: a table says nothing of its columns; give --map: {', '.join(SHIPPED)} or a file")
    try:
        return mapped(tables, load_map(name), notes), name
    except FlightLogError as error:
        raise FlightLogError(f"{path}: {error}") from error
