"""Times of messages as integer nanoseconds, beside what the messages hold."""

from typing import Any

import numpy as np

from quad_flight_log.bag.cdr import Table
from quad_flight_log.errors import FlightLogError, SchemaError


def with_times(table: Table, log_times: list[int], where: str) -> Table:
    """Return ``table`` with ``log_ns`` and, where the type has a stamp, ``stamp_ns`` before its own fields."""
    logged = np.array(log_times, dtype=np.uint64)
    if len(logged) and logged.max() > np.iinfo(np.int64).max:
        raise FlightLogError(f"{where}: log time {logged.max()} is beyond the year 2262")
    names = table.dtype.names or ()
    taken = next((name for name in ("log_ns", "stamp_ns") if name in names), None)
    if taken:
        raise SchemaError(f"{where}: has a field {taken!r}, the name under which times of messages are given")
    stamp = _stamp(table)
    described: list[Any] = [("log_ns", np.int64)]
    if stamp is not None:
        described.append(("stamp_ns", np.int64))
    out = np.empty(len(table), np.dtype(described + [(name, table.dtype[name]) for name in names]))
    out["log_ns"] = logged.astype(np.int64)
    if stamp is not None:
        out["stamp_ns"] = stamp
    for name in names:
        out[name] = table[name]
    return out


def _stamp(table: Table) -> Any:
    for path in (("stamp",), ("header", "stamp"), ("clock",)):
        part: Any = table
        for name in path:
            part = part[name] if name in (part.dtype.names or ()) else None
            if part is None:
                break
        if part is not None and part.dtype.names == ("sec", "nanosec"):
            return part["sec"].astype(np.int64) * 1_000_000_000 + part["nanosec"].astype(np.int64)
    return None
