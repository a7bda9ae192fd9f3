"""When the guard flew instead of the controller (``flight/guard``), or a standby did (``flight/takeover``)."""

from collections.abc import Iterable
from typing import NamedTuple

from quad_core.cascade import SHADOW
from quad_core.guard import MODES, PASS
from quad_flight_log.bag.reader import Flight

TOPIC = "flight/guard"
EXCHANGE_TOPIC = "flight/takeover"
_FIELDS = ("mode", "reason_text", "since", "stamp_ns")


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
    table = flight.array(TOPIC) if flight.has(TOPIC) else None
    if table is None or not set(_FIELDS) <= set(table.dtype.names or ()):
        return []
    rows = [(int(row["mode"]), str(row["reason_text"]), int(row["since"]), int(row["stamp_ns"])) for row in table]
    found: list[Takeover] = []
    last_ns = max([stamp for *_, stamp in rows] + _last_of_truth(flight), default=0)
    before = (PASS, "", 0)
    for mode, reason, since, stamp in rows:
        if (mode, reason, since) == before:
            continue
        if found and before[0] != PASS:
            found[-1] = found[-1]._replace(end_ns=stamp)
        if mode != PASS:
            found.append(Takeover(MODES[mode], reason, since, stamp, last_ns))
        before = (mode, reason, since)
    return found


class Exchange(NamedTuple):
    """From which plant step on a standby flew, in whose role, and why; stamps in ns."""

    role: str
    why: str
    step: int
    begin_ns: int
    end_ns: int


def exchanges(flight: Flight) -> list[Exchange]:
    """Return the exchanges of a flight in order, each to the end of its bag; none without ``flight/takeover``."""
    table = flight.array(EXCHANGE_TOPIC) if flight.has(EXCHANGE_TOPIC) else None
    period = str(flight.metadata.get("plant_period_ns", ""))
    if table is None or not {"role", "detail", "step"} <= set(table.dtype.names or ()) or not period.isdecimal():
        return []
    rows = sorted({(int(row["step"]), str(row["role"]), str(row["detail"])) for row in table})
    begins = [step * int(period) for step, _, _ in rows]
    last_ns = max(begins + _last_of_truth(flight), default=0)
    return [
        Exchange(role.removeprefix(SHADOW), why, step, begin, last_ns)
        for (step, role, why), begin in zip(rows, begins, strict=True)
    ]


def _last_of_truth(flight: Flight) -> list[int]:
    """Return the last stamp of ``truth`` in ns, none where the bag has none."""
    return [int(stamp) for stamp in flight.array("truth")["stamp_ns"][-1:]] if flight.has("truth") else []


def described(found: Iterable[Takeover]) -> str:
    """Return takeovers as one line for people, empty for none."""
    texts = [f"the guard took over at step {one.step} ({one.mode}): {one.reason}" for one in found]
    return "; ".join(texts)
