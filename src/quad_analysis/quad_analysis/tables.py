"""A flight's topics, checked field by field: tables for metrics and figures, takeovers, the nodes' parameters.

A bag of others may have a topic of ours with another type, or a type of ours with other fields.
"""

from collections.abc import Mapping
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_analysis.arrays import Floats, by_stamp, matched, norms
from quad_analysis.metrics import FlightMetrics, flight_metrics, rmse
from quad_core.cascade import COMMAND, ROLES, SIGNALS, VEHICLE_INTERFACES
from quad_core.enumerations import GuardMode
from quad_core.parameter_files import read_parameter_text
from quad_core.parameters import ParameterError, Value
from quad_core.plugins import PluginError
from quad_core.records import dtype_of
from quad_core.resolution import Resolved, resolve, with_law
from quad_core.roles import VehicleInterface
from quad_flight_log.errors import CorruptError, FlightLogError, TopicError
from quad_flight_log.messages import Table, flat_columns, part_of
from quad_flight_log.reader import Flight

# Fields without which a topic is of no use; the others are used where they are there.
NEEDED: Mapping[str, tuple[str, ...]] = {
    "truth": ("p_w", "q_wb", "omega_b"),
    "reference": ("trajectory_time", "p_w", "yaw"),
    "attitude_setpoint": ("angles",),
    COMMAND: tuple(f"wrench.{part}.{axis}" for part in ("force", "torque") for axis in "xyz"),
    "actuation": ("thrust", "thrust_high", "thrust_low", "roll_limited", "pitch_limited", "yaw_limited"),
    "disturbance": (),
    "position_controller/internals": (),
    "attitude_controller/internals": (),
    "flight/mode": ("mode",),
}
TOPICS = tuple(NEEDED)
LARGEST = 1e9  # m, s, N, ...: beyond it no number belongs to a flight
TEXTS: Mapping[str, Mapping[str, str]] = {
    "flight/plan": {"trajectory": "O"},
    "flight/events": {"stamp_ns": "i", "severity": "iu", "node": "O", "kind": "O", "text": "O"},
    "flight/parameters": {"role": "O", "node": "O", "parameters": "O", "internals_names": "O", "step": "iu"},
}


def flight_tables(flight: Flight) -> dict[str, Table]:
    """Return {topic: table} of those of TOPICS that the flight has; raises TopicError if one lacks a needed field.

    Messages with a needed number that is not finite are left out (``unusable_messages``): no node of a flight sends
    such a one, a foreign node may. In the flown path the checks reject them too. A vehicle that is no simulator sends
    no truth: ``state`` replaces it, see ``truth_topic``.
    """
    return _tables(flight)[0]


def unusable_messages(flight: Flight) -> dict[str, int]:
    """Return {topic: messages that the metrics leave out}; raises TopicError as ``flight_tables``."""
    return _tables(flight)[1]


def _tables(flight: Flight) -> tuple[dict[str, Table], dict[str, int]]:
    tables, left_out = dict[str, Table](), dict[str, int]()
    for topic in TOPICS:
        source = truth_topic(flight) if topic == "truth" else topic
        if not flight.has(source):
            continue
        table = flight.array(source)
        _check(flight, source, table)
        good = _usable(topic, table)
        if topic == "truth" and not good.any():
            where = f"{flight.path}: {source}"
            raise TopicError(f"{where}: every message holds a number that is not finite, or larger than {LARGEST:g}")
        if not good.all():
            left_out[source] = int((~good).sum())
        if good.any():
            tables[topic] = table[good]
    return tables, left_out


def measured(flight: Flight) -> FlightMetrics:
    """Return the metrics of an opened flight from whatever of the needed topics it has.

    Raises TopicError if it lacks all of them.
    """
    tables = flight_tables(flight)
    if not tables:
        raise flight.without_topics("there is nothing to measure")
    return flight_metrics(tables)


def measured_between(flight: Flight, state: str, reference: str) -> FlightMetrics:
    """Return the metrics of position of two topics of any type, the reference's between its samples.

    Raises TopicError for a topic without a position in m or without a time in common with the other.
    """
    (times, places), (asked, wanted) = _places(flight, state), _places(flight, reference)
    inside = (times >= asked.min()) & (times <= asked.max())
    if not inside.any():
        raise TopicError(f"{flight.path}: {state} and {reference}: found no stamp of the one within those of the other")
    times, order = times[inside], np.argsort(asked, kind="stable")
    kind = [("stamp_ns", "i8"), ("p_w", "f8", 3), ("trajectory_time", "f8")]
    flown, led = np.zeros(len(times), kind), np.zeros(len(times), kind)
    flown["stamp_ns"] = led["stamp_ns"] = times
    flown["p_w"], led["trajectory_time"] = places[inside], (times - times[0]) * 1e-9
    for axis in range(3):
        led["p_w"][:, axis] = np.interp(times, asked[order], wanted[order, axis])
    return flight_metrics({"truth": flown, "reference": led})


def _places(flight: Flight, topic: str) -> tuple[NDArray[np.int64], Floats]:
    """Return stamps in ns and the finite positions in m, shape (n, 3), of Odometry, a pose, a point or a state."""
    table = flight.array(topic)
    columns = dict(flat_columns(table))
    ends = [name.removesuffix("x") for name in columns if name.endswith(("position.x", "point.x", "translation.x"))]
    names = (
        [f"p_w[{axis}]" for axis in range(3)]
        if "p_w[0]" in columns
        else [f"{end}{a}" for end in ends[:1] for a in "xyz"]
    )
    if not names:
        raise TopicError(f"{flight.path}: {topic}: found no position, expected Odometry, a pose, a point or a state")
    places = np.stack([columns[name].astype(float) for name in names], axis=1)
    good = np.isfinite(places).all(axis=1)
    return columns["stamp_ns" if "stamp_ns" in columns else "log_ns"][good].astype(np.int64), places[good]


def truth_topic(flight: Flight) -> str:
    """Return where the flown path comes from: ``truth``, or ``state`` in a bag that has messages of that only.

    Also ``state`` where the laws fly on an autopilot's estimate: how far that wanders is not the laws' error.
    """
    on_estimate = not flight.has("truth") or any(one.flies_on_estimate for one in vehicle_interfaces(flight))
    return "state" if flight.has("state") and on_estimate else "truth"


def vehicle_interfaces(flight: Flight) -> list[VehicleInterface]:
    """Return the entries of VEHICLE_INTERFACES whose nodes have their parameters in the bag."""
    nodes = text_table(flight, "flight/parameters")["node"] if flight.has("flight/parameters") else ()
    names = {node.rpartition("/")[2] for node in nodes}
    return [one for name, one in VEHICLE_INTERFACES.items() if name in names]


def autopilot_lands(flight: Flight) -> bool:
    """Return whether a flight that is given up ends with an autopilot in command: what it does then is not recorded."""
    return any(one.autopilot_lands for one in vehicle_interfaces(flight))


def estimate_note(flight: Flight) -> str:
    """Return how far the estimate was from truth, and how far the flown path was from its reference in truth."""
    state, truth = (by_stamp(flight.array(topic)) for topic in ("state", "truth"))
    parts, off = ["errors are those of `state`, the autopilot's estimate, on which the laws fly"], _apart(state, truth)
    if len(off):
        parts.append(f"it was {rmse(off):.3f} m (RMSE), at most {off.max():.3f} m, from truth")
    if flight.has("reference"):
        reference = by_stamp(flight.array("reference"))
        error = _apart(truth, reference[reference["trajectory_time"] >= 0.0])
        parts += [f"truth was {rmse(error):.3f} m (RMSE) from the reference"] if len(error) else []
    return "; ".join(parts)


def _apart(one: Table, other: Table) -> Floats:
    """Return how far in m the places of two tables are apart at the stamps that both have."""
    one, other = matched(one, other)
    return norms(one["p_w"] - other["p_w"])


def truth_note(flight: Flight) -> str:
    """Return what to say of errors that are not those of ``truth``, or not of the whole flight; else empty."""
    found = []
    if flight.has("truth") and truth_topic(flight) == "state":
        found.append(estimate_note(flight))
    elif truth_topic(flight) != "truth":
        found.append("no truth in the bag: flown is what `state` says, an estimator's errors included")
    if flight.has("flight/mode"):
        found.append("metrics are those of mode MISSION alone")
    for topic, count in unusable_messages(flight).items():
        found.append(f"{topic}: {count} messages with a number that is not finite, or beyond {LARGEST:g}, are left out")
    return "; ".join(found)


def text_table(flight: Flight, topic: str) -> Table:
    """Return a topic of TEXTS; raises TopicError if it lacks a needed field."""
    table = flight.array(topic)
    for name, kinds in TEXTS[topic].items():
        if name not in (table.dtype.names or ()) or table.dtype[name].kind not in kinds:
            raise _wrong(flight, topic, name)
    return table


def _check(flight: Flight, topic: str, table: Table) -> None:
    kind = dtype_of(SIGNALS[topic].kind)
    shapes = {name: kind[name].shape for name in kind.names or ()}
    optional = [name for name in shapes if name in (table.dtype.names or ())]
    for name in ("stamp_ns", *NEEDED["truth" if topic == "state" else topic], *optional):
        values = part_of(table, name)
        if values is None or values.dtype.kind not in "biuf" or values.shape[1:] != shapes.get(name, ()):
            raise _wrong(flight, topic, name)


def _usable(topic: str, table: Table) -> NDArray[np.bool_]:
    """Return which rows hold only finite numbers of a size that belongs to a flight, in the fields that are needed."""
    good = np.ones(len(table), dtype=bool)
    for name in NEEDED[topic]:
        good &= (np.abs(part_of(table, name).reshape(len(table), -1)) <= LARGEST).all(axis=1)  # of NaN it is false
    return good


def _wrong(flight: Flight, topic: str, field: str) -> TopicError:
    found = flight.topics[flight.resolve(topic)].type
    return TopicError(f"{flight.path}: {topic}: its type {found} has no field {field!r} as a flight has it")


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


PARAMETERS = "flight/parameters"


class Change(NamedTuple):
    """Parameters that a node got in flight, and the plant step they hold from."""

    step: int
    values: dict[str, Value]


class NodeRecord(NamedTuple):
    """The parameters of one node before the flight, and their changes in flight in order."""

    values: dict[str, Value]
    internals_names: list[str]
    changes: tuple[Change, ...]


def recorded_parameters(flight: Flight) -> dict[str, NodeRecord]:
    """Return {role: parameters} from what the nodes published.

    Raises TopicError if the bag lacks them, CorruptError if they cannot be read.
    """
    if not flight.has(PARAMETERS):
        raise TopicError(f"{flight.path}: no topic {PARAMETERS!r}: with which parameters the nodes flew is unknown")
    found: dict[str, NodeRecord] = {}
    for row in text_table(flight, PARAMETERS):
        role = str(row["role"])
        if role not in ROLES:
            continue
        try:
            content = read_parameter_text(str(row["parameters"]), f"{flight.path}: {PARAMETERS}")
        except ParameterError as error:
            raise CorruptError(f"{flight.path}: recorded parameters cannot be read: {error}") from error
        values = {name: value for body in content.values() for name, value in body.items()}
        before, step, names = found.get(role), int(row["step"]), [str(name) for name in row["internals_names"]]
        if before is None or (row["log_ns"] <= 0 and not before.changes):
            found[role] = NodeRecord(values, names, ())
        elif step and values != (before.changes[-1].values if before.changes else before.values):
            # step 0, later: a process that was started again says what it was set up with
            found[role] = before._replace(changes=(*before.changes, Change(step, values)))
    return found


def flown_phases(record: NodeRecord, role: str, law: str | None = None) -> list[tuple[int, Resolved]]:
    """Return (plant step, parameters from it on) of a controller, or of another ``law`` with its defaults.

    The first phase begins at step 0, each change in flight another. Raises FlightLogError.
    """
    spells = [(0, record.values), *((change.step, change.values) for change in record.changes)]
    try:
        return [(step, resolve(role, with_law(values, law) if law else values)) for step, values in spells]
    except (ParameterError, PluginError) as error:
        raise FlightLogError(f"{role}: {error}") from error
