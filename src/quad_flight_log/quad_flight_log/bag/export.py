"""A flight for other tools: CSV or Parquet, topic by topic, in blocks of bounded size."""

import csv
import itertools
import json
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from quad_flight_log.bag.messages import Column
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import FlightLogError, SchemaError

FORMATS = ("csv", "parquet")
_LONGEST_NAME = 200


class ExportError(FlightLogError):
    """The flight cannot be written in that form."""


class Exported(NamedTuple):
    """The files that were written, and {topic: why} of topics that cannot be read."""

    paths: list[Path]
    left_out: dict[str, str]


def export(flight: Flight, directory: Path, form: str, topics: list[str]) -> Exported:
    """Write ``topics`` (empty: all with messages) into ``directory``, in files which must not exist yet.

    A topic that cannot be read is left out and named. Raises ExportError for an existing file or a library that is
    missing, TopicError for a topic that the bag has not.
    """
    names = [flight.resolve(topic) for topic in topics] or [
        name for name, topic in flight.topics.items() if topic.messages
    ]
    left_out = {name: flight.unreadable[name] for name in names if name in flight.unreadable}
    names = [name for name in names if name not in left_out]
    directory.mkdir(parents=True, exist_ok=True)
    write = _parquet if form == "parquet" else _csv
    taken: set[str] = set()
    files = {name: directory / f"{_free_name(name, taken)}.{form}" for name in names}
    there = next((path for path in files.values() if path.exists()), None)
    if there:
        raise ExportError(f"{there}: exists; an export never overwrites")
    paths = []
    for name, path in files.items():
        part = path.with_name(path.name + ".part")
        try:
            write(flight, name, part)
        except SchemaError as error:
            left_out[name] = str(error)
            part.unlink(missing_ok=True)
        else:
            part.rename(path)
            paths.append(path)
    return Exported(paths, left_out)


def _free_name(topic: str, taken: set[str]) -> str:
    """Return a topic as a file name: /a/b becomes a_b, or a_b_2 where another topic has that name already.

    Names that differ in capitals alone count as equal: on some file systems they are.
    """
    plain = re.sub(r"[^\w.-]", "_", topic.strip("/"))[:_LONGEST_NAME] or "_"
    names = itertools.chain([plain], (f"{plain}_{number}" for number in itertools.count(2)))
    name = next(name for name in names if name.casefold() not in taken)
    taken.add(name.casefold())
    return name


def _csv(flight: Flight, name: str, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8", errors="backslashreplace") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        head = False
        for _, table in flight.batches(name):
            block = list(flight.columns(name, table))
            if not head:
                writer.writerow(column.name for column in block)
                head = True
            writer.writerows(zip(*(_cells(column) for column in block), strict=True))


def _cells(column: Column) -> list[Any]:
    items: list[Any] = column.values.tolist()
    return [json.dumps(item) for item in items] if column.form.startswith("list") else items


def _parquet(flight: Flight, name: str, path: Path) -> None:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise ExportError("parquet: install the Python package pyarrow") from error

    def kind(form: str) -> Any:
        if form.startswith("list "):
            return pa.list_(kind(form[5:]))
        return pa.string() if form == "text" else pa.from_numpy_dtype(np.dtype(form))

    writer: Any = None
    try:
        for _, table in flight.batches(name):
            block = list(flight.columns(name, table))
            arrays = [pa.array(column.values.tolist(), kind(column.form)) for column in block]
            content = pa.table(arrays, names=[column.name for column in block])
            writer = writer or pq.ParquetWriter(path, content.schema)
            writer.write_table(content)
    finally:
        if writer is not None:
            writer.close()
