"""The parameters of the nodes of a recorded flight, from the bag alone."""

from typing import NamedTuple

from quad_core.cascade import ROLES
from quad_core.parameter_files import read_parameter_text
from quad_core.parameters import ParameterError, Value
from quad_core.plugins import PluginError
from quad_core.resolution import Resolved, resolve, with_law
from quad_flight_log.analysis.tables import text_table
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import CorruptError, FlightLogError, TopicError

TOPIC = "flight/parameters"


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
    if not flight.has(TOPIC):
        raise TopicError(f"{flight.path}: no topic {TOPIC!r}: with which parameters the nodes flew is unknown")
    found: dict[str, NodeRecord] = {}
    for row in text_table(flight, TOPIC):
        role = str(row["role"])
        if role not in ROLES:
            continue
        try:
            content = read_parameter_text(str(row["parameters"]), f"{flight.path}: {TOPIC}")
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
