"""A flight for other tools: CSV, Parquet, MATLAB. Topic by topic, CSV and Parquet in blocks of bounded size."""

import csv
import itertools
import json
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.bag.messages import Column
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import FlightLogError, SchemaError

FORMATS = ("csv", "parquet", "mat")
_LONGEST_NAME = 200
_LONGEST_MATLAB = 50  # of the 63 letters of a name; a number may follow


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
    if form == "mat":
        path = _new(directory / f"{flight.path.name.partition('.')[0]}.mat")
        return Exported([_matlab(flight, path, names, left_out)], left_out)
    write = _parquet if form == "parquet" else _csv
    taken: set[str] = set()
    files = {name: _new(directory / f"{_free_name(name, taken)}.{form}") for name in names}
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


def write_csv(path: Path, content: Mapping[str, NDArray[Any]]) -> None:
    """Write columns of equal length, floats with all their digits."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(content)
        writer.writerows(zip(*(values.tolist() for values in content.values()), strict=True))


def _new(path: Path) -> Path:
    if path.exists():
        raise ExportError(f"{path}: exists; an export never overwrites")
    return path


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


def _matlab(flight: Flight, path: Path, names: list[str], left_out: dict[str, str]) -> Path:
    try:
        from scipy.io import savemat
    except ImportError as error:
        raise ExportError("mat: install the Python package scipy") from error
    content: dict[str, Any] = {"metadata": None, "parameters": None}
    for name in names:
        try:
            content[_matlab_name(name.strip("/"), content)] = _struct(flight.array(name))
        except SchemaError as error:  # noqa: PERF203 (the other topics are exported)
            left_out[name] = str(error)
    notes: dict[str, Any] = {}
    for key, value in flight.metadata.items():
        notes[_matlab_name(key, notes)] = value
    content["metadata"], content["parameters"] = notes, flight.parameters_text
    try:
        savemat(path, content, long_field_names=True, oned_as="column")
    except ValueError as error:
        path.unlink(missing_ok=True)
        raise ExportError(f"{path}: {error}") from error
    return path


def _matlab_name(text: str, taken: Collection[str]) -> str:
    """Return ``text`` as a name that MATLAB admits (letter first, then letters, digits, _) and that is not taken."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", text)[:_LONGEST_MATLAB]
    first = plain if plain[:1].isalpha() else f"t{plain}"
    names = itertools.chain([first], (f"{first}_{number}" for number in itertools.count(2)))
    return next(name for name in names if name not in taken)


def _struct(table: NDArray[Any]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name in table.dtype.names or ():
        values = table[name]
        out[name] = _struct(values) if values.dtype.names else values
    return out
