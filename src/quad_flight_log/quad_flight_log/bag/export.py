"""A flight for other tools: one CSV file per topic."""

import csv
import itertools
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.bag.messages import Table, flat_columns
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import FlightLogError, SchemaError

_LONGEST_NAME = 200


def export(flight: Flight, directory: Path, topics: list[str]) -> tuple[list[Path], dict[str, str]]:
    """Write ``topics`` (empty: all with messages) into ``directory``; return the files, and {topic: why} of the rest.

    A topic that cannot be read is left out. Raises FlightLogError for an existing file, TopicError for a topic that
    the bag has not.
    """
    names = [flight.resolve(topic) for topic in topics] or [
        name for name, topic in flight.topics.items() if topic.messages
    ]
    directory.mkdir(parents=True, exist_ok=True)
    paths, left_out, taken = list[Path](), dict[str, str](), set[str]()
    for name in names:
        try:
            table = flight.array(name)
        except SchemaError as error:  # noqa: PERF203
            left_out[name] = str(error)
        else:
            paths.append(directory / f"{_free_name(name, taken)}.csv")
            _write(table, paths[-1])
    return paths, left_out


def _free_name(topic: str, taken: set[str]) -> str:
    """Return a topic as a file name: /a/b becomes a_b, or a_b_2 where another topic has that name already.

    Names that differ in capitals alone count as equal: on some file systems they are.
    """
    plain = re.sub(r"[^\w.-]", "_", topic.strip("/"))[:_LONGEST_NAME] or "_"
    names = itertools.chain([plain], (f"{plain}_{number}" for number in itertools.count(2)))
    name = next(name for name in names if name.casefold() not in taken)
    taken.add(name.casefold())
    return name


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
