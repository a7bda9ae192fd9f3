"""A flight for other tools: one CSV file per topic."""

import csv
import json
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.bag.messages import Table, flat_columns
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import FlightLogError, SchemaError

_LONGEST_NAME = 200


def export(flight: Flight, directory: Path, topics: list[str]) -> tuple[list[Path], list[str]]:
    """Write ``topics`` (empty: all with messages) into ``directory``; return the files, and why the rest is left out.

    The topic /a/b becomes a.b.csv. Raises FlightLogError for an existing file, TopicError for a topic that the bag has
    not.
    """
    every = [name for name, topic in flight.topics.items() if topic.messages]
    names = dict.fromkeys(map(flight.resolve, topics)) or every
    directory.mkdir(parents=True, exist_ok=True)
    paths, left_out = list[Path](), list[str]()
    for name in names:
        plain = quote(name.strip("/").replace("/", "."), safe="", errors="backslashreplace")[:_LONGEST_NAME]
        try:
            _write(flight.array(name), directory / f"{plain}.csv")
            paths.append(directory / f"{plain}.csv")
        except SchemaError as error:
            left_out.append(str(error))
    return paths, left_out


def _write(table: Table, path: Path) -> None:
    columns = dict(flat_columns(table))
    try:
        with path.open("x", newline="", encoding="utf-8", errors="backslashreplace") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(zip(*map(_cells, columns.values()), strict=True))
    except FileExistsError as error:
        raise FlightLogError(f"{path}: exists; an export never overwrites") from error


def _cells(values: NDArray[Any]) -> list[Any]:
    """Return the cells of a column: numbers and texts as they are, what a sequence holds as JSON."""
    items: list[Any] = values.tolist()
    if values.dtype != object:
        return items
    return [item if isinstance(item, str) else json.dumps(item, default=_plain) for item in items]


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)
