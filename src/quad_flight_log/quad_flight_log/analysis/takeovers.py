"""When the guard flew instead of the controller (``flight/guard``), or another controller (``flight/takeover``)."""

from collections.abc import Iterable
from typing import NamedTuple

from quad_core.cascade import SHADOW, STAGE
from quad_flight_log.bag.messages import Table
from quad_flight_log.bag.reader import Flight
from quad_guard.guard import MODES, PASS

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
    said = _of_its_run(flight, table)
    rows = [(int(row["mode"]), str(row["reason_text"]), int(row["since"]), int(row["stamp_ns"])) for row in said]
    found: list[Takeover] = []
    last_ns = max([stamp for *_, stamp in rows] + _last_of_truth(flight), default=0)
    before = (PASS, "", 0)
    for mode, reason, since, stamp in rows:
        if (mode, reason, since) == before:
            continue
        if found and before[0] != PASS:
            found[-1] = found[-1]._replace(end_ns=stamp)
        if mode != PASS:
            name = MODES[mode] if mode < len(MODES) else f"mode {mode}"  # anybody can send one that there is not
            found.append(Takeover(name, reason, since, stamp, last_ns))
        before = (mode, reason, since)
    return found


class Flier(NamedTuple):
    """A node that flew a stage from plant step ``step`` on with a memory that began at ``memory_step``; ``why``."""

    node: str
    step: int
    memory_step: int
    why: str


def fliers(flight: Flight, role: str) -> list[Flier]:
    """Return which nodes flew the stage of ``role`` in order: the controller, then each that took over.

    Each message replaces one of the same node: that from where the other really left. Of an older bag that does not
    say when memories began all did so at the start.
    """
    found = [Flier(role, 0, 0, "")]
    table = flight.array(EXCHANGE_TOPIC) if flight.has(EXCHANGE_TOPIC) else None
    names = set() if table is None else set(table.dtype.names or ())
    if table is None or not {"role", "detail", "step"} <= names:
        return found
    for row in _of_its_run(flight, table):
        node, step = str(row["role"]), int(row["step"])
        if node.removeprefix(SHADOW) != role:
            continue
        began = int(row["memory_step"]) if "memory_step" in names else 0
        if len(found) > 1 and found[-1].node == node:
            found.pop()
        if step > found[-1].step:
            found.append(Flier(node, step, began, str(row["detail"])))
    return found


class Exchange(NamedTuple):
    """The plant step from which a standby flew, its role, and the reason; stamps in ns."""

    role: str
    why: str
    step: int
    begin_ns: int
    end_ns: int


def exchanges(flight: Flight) -> list[Exchange]:
    """Return the exchanges of a flight in order, each to the next one of its role or to the end of its bag."""
    period = str(flight.metadata.get("plant_period_ns", ""))
    if not period.isdecimal():
        return []
    flown = {role: [(each, each.step * int(period)) for each in fliers(flight, role)[1:]] for role in STAGE}
    begins = [begin for each in flown.values() for _, begin in each]
    last_ns = max(begins + _last_of_truth(flight), default=0)
    found = []
    for role, each in flown.items():
        ends = [begin for _, begin in each[1:]] + [last_ns]
        pairs = zip(each, ends, strict=False)
        found += [Exchange(role, one.why, one.step, begin, end) for (one, begin), end in pairs]
    return sorted(found, key=lambda one: one.step)


def _of_its_run(flight: Flight, table: Table) -> Table:
    """Return the messages of the flight's own run: one without a run is left out. All without a run id."""
    run_id = flight.metadata.get("run_id", "")
    return table[table["run_id"] == run_id] if run_id and "run_id" in (table.dtype.names or ()) else table


def _last_of_truth(flight: Flight) -> list[int]:
    """Return the last stamp of ``truth`` in ns, or None."""
    return [int(stamp) for stamp in flight.array("truth")["stamp_ns"][-1:]] if flight.has("truth") else []


def described(found: Iterable[Takeover]) -> str:
    """Return takeovers as one line for people, empty for none."""
    texts = [f"the guard took over at step {one.step} ({one.mode}): {one.reason}" for one in found]
    return "; ".join(texts)
