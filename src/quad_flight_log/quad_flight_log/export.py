"""A flight for other tools: one CSV or Parquet file per topic, or one file of all numbers on one time base."""

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.errors import FlightLogError, SchemaError, needed
from quad_flight_log.messages import flat_columns
from quad_flight_log.reader import Flight

_LONGEST_NAME = 200

Columns = Mapping[str, NDArray[Any]]


def export(
    flight: Flight, directory: Path, topics: list[str], *, parquet: bool = False
) -> tuple[list[Path], list[str]]:
    """Write ``topics`` (empty: all with messages) into ``directory``; return the files, and why the rest is left out.

    The topic /a/b becomes a.b.csv or a.b.parquet. Raises FlightLogError for an existing file, TopicError for a topic
    that the bag has not.
    """
    every = [name for name, topic in flight.topics.items() if topic.messages]
    names = dict.fromkeys(map(flight.resolve, topics)) or every
    paths, left_out = list[Path](), list[str]()
    for name in names:
        plain = quote(name.strip("/").replace("/", "."), safe="", errors="backslashreplace")[:_LONGEST_NAME]
        try:
            paths.append(_write(dict(flat_columns(flight.array(name))), directory / plain, parquet=parquet))
        except SchemaError as error:
            left_out.append(str(error))
    return paths, left_out


def export_one_table(flight: Flight, directory: Path, topics: list[str], base: str, *, parquet: bool = False) -> Path:
    """Write the numbers of ``topics`` into one file, a row per stamp of the topic ``base``; return it.

    Columns: t in s, then TOPIC.FIELD. A value is that of the newest message up to the stamp, NaN before the first.
    """
    stamps = np.unique(flight.array(base)["stamp_ns"])
    columns: dict[str, NDArray[Any]] = {"t": stamps * 1e-9}
    for topic in dict.fromkeys([base, *topics]):
        table = flight.array(topic)
        if "stamp_ns" not in (table.dtype.names or ()):
            continue
        table = table[np.argsort(table["stamp_ns"], kind="stable")]
        at = np.searchsorted(table["stamp_ns"], stamps, side="right") - 1
        for name, values in flat_columns(table):
            if values.dtype.kind in "biuf" and not name.startswith(("stamp.", "log_ns")):
                columns[f"{topic}.{name}"] = np.where(at >= 0, values[at.clip(0)].astype(np.float64), np.nan)
    return _write(columns, directory / "flight", parquet=parquet)


def _write(columns: Columns, path: Path, *, parquet: bool) -> Path:
    path = path.with_name(f"{path.name}.{'parquet' if parquet else 'csv'}")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        if parquet:
            _write_parquet(columns, path)
            return path
        with path.open("x", newline="", encoding="utf-8", errors="backslashreplace") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(zip(*map(_cells, columns.values()), strict=True))
    except FileExistsError as error:
        raise FlightLogError(f"{path}: exists; an export never overwrites") from error
    return path


def _write_parquet(columns: Columns, path: Path) -> None:
    pa, parquet = needed("pyarrow", "Parquet"), needed("pyarrow.parquet", "Parquet")
    with path.open("xb") as stream:
        parquet.write_table(pa.table({name: pa.array(_cells(values)) for name, values in columns.items()}), stream)


def _cells(values: NDArray[Any]) -> list[Any]:
    """Return the cells of a column: numbers and texts as they are, what a sequence holds as JSON."""
    items: list[Any] = values.tolist()
    if values.dtype != object:
        return items
    return [item if isinstance(item, str) else json.dumps(item, default=_plain) for item in items]


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)
