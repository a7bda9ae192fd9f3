"""When the guard flew instead of the controller (``flight/guard``)."""

from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

from quad_core.enumerations import GuardMode
from quad_flight_log.bag.messages import Table
from quad_flight_log.bag.reader import Flight

_NAMES = {int(mode): mode.name.lower() for mode in GuardMode}


class Takeover(NamedTuple):
    """A time in which one mode of the guard held: mode and reason in words, from which plant step on, stamps in ns."""

    mode: str
    reason: str
    step: int
    begin_ns: int
    end_ns: int


def takeovers(flight: Flight) -> list[Takeover]:
    """Return the takeovers of a flight in order, none where its bag has no ``flight/guard``.

    The guard reports every change at its step; a mode that nothing followed holds to the end of the bag.
    """
    said = rows_of(flight, "flight/guard", ("mode", "reason_text", "since", "stamp_ns"))
    rows = [(int(row["mode"]), str(row["reason_text"]), int(row["since"]), int(row["stamp_ns"])) for row in said]
    changes = [next(alike) for _, alike in groupby(rows, key=itemgetter(0, 1, 2))]
    last_of_truth = flight.array("truth")["stamp_ns"][-1:].tolist() if flight.has("truth") else []
    ends = [row[3] for row in changes[1:]] + [max([row[3] for row in rows] + last_of_truth, default=0)]
    return [
        # any node can send a mode that there is not
        Takeover(_NAMES.get(mode, f"mode {mode}"), reason, since, stamp, end)
        for (mode, reason, since, stamp), end in zip(changes, ends, strict=False)
        if mode != GuardMode.PASS
    ]


def rows_of(flight: Flight, topic: str, needed: tuple[str, ...]) -> Table | list[Table]:
    """Return the messages of a topic; none of a type that lacks a field."""
    table = flight.array(topic) if flight.has(topic) else None
    if table is None or not set(needed) <= set(table.dtype.names or ()):
        return []
    return table
