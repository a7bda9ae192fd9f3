"""When the guard flew instead of the controller, from ``flight/guard``."""

from collections.abc import Iterable
from typing import NamedTuple

from quad_core.guard import MODES, PASS
from quad_flight_log.bag.reader import Flight

TOPIC = "flight/guard"
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
    last_ns = max([stamp for *_, stamp in rows], default=0)
    if flight.has("truth"):
        truth = flight.array("truth")
        last_ns = max(last_ns, int(truth["stamp_ns"][-1]) if len(truth) else 0)
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


def described(found: Iterable[Takeover]) -> str:
    """Return takeovers as one line for people, empty for none."""
    texts = [f"the guard took over at step {one.step} ({one.mode}): {one.reason}" for one in found]
    return "; ".join(texts)
