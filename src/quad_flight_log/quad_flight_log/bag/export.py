"""A flight for other tools: one CSV file per topic."""

import csv
import itertools
import json
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.bag.messages import Table, flat_columns
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import FlightLogError, SchemaError

_LONGEST_NAME = 200


class Exported(NamedTuple):
    """The files that were written, and {topic: why} of topics that cannot be read."""

    paths: list[Path]
    left_out: dict[str, str]


def export(flight: Flight, directory: Path, topics: list[str]) -> Exported:
    """Write ``topics`` (empty: all with messages) into ``directory``, in files which must not exist yet.

    A topic that cannot be read is left out and named. Raises FlightLogError for an existing file, TopicError for a
    topic that the bag has not.
    """
    names = [flight.resolve(topic) for topic in topics] or [
        name for name, topic in flight.topics.items() if topic.messages
    ]
    directory.mkdir(parents=True, exist_ok=True)
    taken: set[str] = set()
    files = {name: directory / f"{_free_name(name, taken)}.csv" for name in names if name not in flight.unreadable}
    there = next((path for path in files.values() if path.exists()), None)
    if there:
        raise FlightLogError(f"{there}: exists; an export never overwrites")
    found = Exported([], {name: flight.unreadable[name] for name in names if name in flight.unreadable})
    for name, path in files.items():
        try:
            table = flight.array(name)
        except SchemaError as error:  # noqa: PERF203
            found.left_out[name] = str(error)
        else:
            _write(table, path)
            found.paths.append(path)
    return found


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
    part = path.with_name(path.name + ".part")
    columns = dict(flat_columns(table))
    with part.open("w", newline="", encoding="utf-8", errors="backslashreplace") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*map(_cells, columns.values()), strict=True))
    part.rename(path)


def _cells(values: NDArray[Any]) -> list[Any]:
    """Return the cells of a column: numbers and texts as they are, what a sequence holds as JSON."""
    items: list[Any] = values.tolist()
    if values.dtype != object:
        return items
    return [item if isinstance(item, str) else json.dumps(item, default=_plain) for item in items]


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)
