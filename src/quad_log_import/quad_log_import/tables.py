"""Reads logs of others as tables: {table: {column: values, shape (n,)}}, each with its time in s as column ``t``.

What a file says of its own size counts only as far as the file is long.
"""

import contextlib
import io
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from quad_flight_log.errors import FlightLogError, one_line
from quad_flight_log.messages import flat_columns
from quad_flight_log.reader import open_flight
from quad_log_import.telemetry import Table, read_tlog

Tables = dict[str, Table]
LARGEST = 300 << 20  # bytes of a file
MOST_CELLS = 60_000_000
_USD_TYPES = {"B": "u1", "b": "i1", "H": "<u2", "h": "<i2", "I": "<u4", "i": "<i4", "f": "<f4", "Q": "<u8", "q": "<i8"}


def read_tables(path: Path) -> tuple[str, Tables, list[str]]:
    """Return (format, tables, notes on damage) of the log at ``path``: ulog, tlog, usd, table or bag; one branch each.

    Raises FlightLogError for what is no log, is too large, or holds nothing.
    """
    if path.is_dir() or path.suffix in (".mcap", ".db3", ".part"):
        return "bag", *_bag(path)
    data = _content(path)
    found: tuple[str, Callable[[Path, bytes], tuple[Tables, list[str]]]] = ("table", _table)
    if path.name.removesuffix(".gz").endswith(".tlog"):
        found = ("tlog", read_tlog)
    elif data.startswith(b"ULog\x01\x12\x35"):
        found = ("ulog", _ulog)
    elif data[:1] == b"\xbc":
        found = ("usd", _usd)
    try:
        tables, notes = found[1](path, data)
    except FlightLogError as error:
        raise FlightLogError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from error
    except MemoryError as error:
        raise FlightLogError(f"{path}: damaged: asks for more memory than a log of {len(data)} bytes needs") from error
    except Exception as error:  # whatever a parser raises over bytes that are no log
        raise FlightLogError(f"{path}: damaged, or no {found[0]}: {type(error).__name__}: {one_line(error)}") from error
    if not any(len(table["t"]) for table in tables.values()):
        raise FlightLogError(f"{path}: holds no sample")
    return found[0], tables, notes


def _content(path: Path) -> bytes:
    """Return the bytes of a file, unpacked if it is packed by gzip."""
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
    except OSError as error:
        raise FlightLogError(f"{path}: {error.strerror or error}") from error
    if data[:2] == b"\x1f\x8b":
        try:
            data = zlib.decompressobj(wbits=31).decompress(data, LARGEST + 1)
        except zlib.error as error:
            raise FlightLogError(f"{path}: damaged gzip: {one_line(error)}") from error
    if len(data) > LARGEST:
        raise FlightLogError(f"{path}: found more than {LARGEST} bytes, which is too large")
    return data


class _Patient(io.BytesIO):
    """Bytes that end the reading of a damaged log: pyulog looks for its next message byte by byte."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data)
        self._left = len(data) // 2 + 1000

    def read(self, size: int | None = -1, /) -> bytes:
        """Return the next bytes; raises FlightLogError after more calls than messages fit into a whole log."""
        self._left -= 1
        if self._left < 0:
            raise FlightLogError(f"damaged: found no message for long at byte {self.tell()}, expected a ULog")
        return super().read(size)


def _ulog(_: Path, data: bytes) -> tuple[Tables, list[str]]:
    try:
        from pyulog import ULog
    except ImportError as error:
        raise FlightLogError("ULog files need pyulog: pip install -r requirements/extras.txt") from error
    with contextlib.redirect_stdout(io.StringIO()):  # it prints what it meets
        log = ULog(_Patient(data), disable_str_exceptions=True)
    tables: Tables = {}
    for one in log.data_list:
        name = one.name if one.multi_id == 0 else f"{one.name}.{one.multi_id}"
        columns = {field: np.asarray(values) for field, values in one.data.items()}
        tables[name] = {**columns, "t": columns["timestamp"].astype(float) * 1e-6}
    notes = [
        f"the log lost {len(log.dropouts)} spans of data, {sum(each.duration for each in log.dropouts)} ms"
    ] * bool(log.dropouts)
    notes += ["the file is damaged: what could be read is here"] * bool(log.file_corruption)
    names = ("THR_MDL_FAC", "SYS_AUTOSTART", "CA_ROTOR_COUNT")
    notes += [f"parameter {name} = {log.initial_parameters[name]}" for name in names if name in log.initial_parameters]
    return tables, notes


def _usd(path: Path, data: bytes) -> tuple[Tables, list[str]]:
    """Read a log of the Crazyflie's micro-SD deck (cfusdlog), version 1 or 2."""
    version, count = struct.unpack_from("<HH", data, 1)
    if version not in (1, 2) or count > 1000:
        raise FlightLogError(f"found version {version} with {count} events, expected version 1 or 2")
    at, kinds = 5, dict[int, tuple[str, np.dtype[Any]]]()
    time = ("t", "<u8" if version == 2 else "<u4")
    for _ in range(count):
        (number,) = struct.unpack_from("<H", data, at)
        name, at = _text(path, data, at + 2)
        (fields,) = struct.unpack_from("<H", data, at)
        at, described = at + 2, []
        for _ in range(fields):
            text, at = _text(path, data, at)
            if len(text) < 4 or text[-2] not in _USD_TYPES:
                raise FlightLogError(f"byte {at}: found variable {text!r}, expected NAME(TYPE)")
            described.append((text[:-3], _USD_TYPES[text[-2]]))
        kinds[number] = (name, np.dtype([time, *described]))
    rows: dict[int, list[int]] = {number: [] for number in kinds}
    damage = ""
    while at + 2 <= len(data):
        if len(data) - at == 4:  # the checksum of a log that was closed
            if zlib.crc32(data[:at]) != int.from_bytes(data[at:], "little"):
                damage = "the checksum at its end does not fit"
            break
        number = data[at] | data[at + 1] << 8
        if number not in kinds:
            damage = f"byte {at}: found event {number}, expected one of {', '.join(map(str, kinds))}"
            break
        if at + 2 + kinds[number][1].itemsize > len(data):
            damage = f"cut in the last sample, at byte {at}"
            break
        rows[number].append(at + 2)
        at += 2 + kinds[number][1].itemsize
    tables: Tables = {}
    for number, (name, kind) in kinds.items():
        parts = b"".join(data[start : start + kind.itemsize] for start in rows[number])
        table = np.frombuffer(parts, kind)
        factor = 1e-6 if version == 2 else 1e-3
        tables[name] = {field: table[field] for field in kind.names or ()} | {"t": table["t"].astype(float) * factor}
    return tables, [f"{damage}: what is before it is here"] if damage else []


def _text(path: Path, data: bytes, at: int) -> tuple[str, int]:
    end = data.find(b"\0", at, at + 200)
    if end < 0:
        raise FlightLogError(f"{path}: byte {at}: found no end of a name, expected one within 200 bytes")
    return data[at:end].decode("ascii", "replace"), end + 1


def _table(path: Path, data: bytes) -> tuple[Tables, list[str]]:
    """Read CSV (also .gz) or Parquet; every column of numbers."""
    try:
        import pandas as pd
    except ImportError as error:
        raise FlightLogError("CSV and Parquet need pandas: pip install -r requirements/extras.txt") from error
    if data.startswith(b"PAR1"):
        import pyarrow.parquet as pq

        about = pq.ParquetFile(io.BytesIO(data)).metadata
        if about.num_rows * about.num_columns > MOST_CELLS:
            raise FlightLogError(
                f"{path}: found {about.num_rows} rows, expected at most {MOST_CELLS // about.num_columns}"
            )
        frame = pd.read_parquet(io.BytesIO(data))
    else:
        frame = pd.read_csv(io.BytesIO(data), comment="#", skipinitialspace=True, nrows=MOST_CELLS // 50)
    numbers = frame.apply(pd.to_numeric, errors="coerce") if len(frame) else frame
    columns = {str(name): numbers[name].to_numpy(float) for name in numbers.columns}
    if len(columns) < 2 or not any(np.isfinite(values).any() for values in columns.values()):
        raise FlightLogError(f"{path}: found {len(columns)} columns of numbers, expected a table with a header")
    return {"": {**columns, "t": np.zeros(len(frame)) if "t" not in columns else columns["t"]}}, []


def _bag(path: Path) -> tuple[Tables, list[str]]:
    flight, tables, notes = open_flight(path), {}, []
    for name in flight.topics:
        if name in flight.unreadable:
            notes.append(f"{name} left out: {flight.unreadable[name]}")
            continue
        table = flight.array(name)
        columns = {}
        for column, values in flat_columns(table):
            if values.dtype.kind in "biuf":
                columns[column] = values
            elif values.dtype == object and len(values) and isinstance(values[0], np.ndarray):
                width = len(values[0])
                if 0 < width <= 32 and all(len(each) == width for each in values):
                    columns |= {f"{column}[{i}]": np.array([each[i] for each in values]) for i in range(width)}
        ns = columns.get("stamp_ns", columns["log_ns"])
        tables[name.lstrip("/")] = {**columns, "t": (columns["log_ns"] if not ns.any() else ns) * 1e-9}
    if flight.truncated:
        notes.append(f"the bag is cut: {flight.damage}")
    return tables, notes
