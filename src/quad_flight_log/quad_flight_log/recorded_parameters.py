"""What the nodes of a recorded flight were told, from the bag alone."""

from collections.abc import Mapping
from typing import NamedTuple

import yaml

from quad_core.node_parameters import ROLES, Resolved, resolve
from quad_core.parameter_files import overrides_for, read_parameter_text
from quad_core.parameters import ParameterError, Value
from quad_core.plugins import PluginError
from quad_core.settings import typed, with_law
from quad_flight_log.errors import CorruptError, FlightLogError, TopicError
from quad_flight_log.reader import Flight

TOPIC = "flight/parameters"


class RecordedParametersError(FlightLogError):
    """The bag does not say what a node was told, or it cannot be told so any more."""


class NodeRecord(NamedTuple):
    """What one node was told before the flight. ``changed``: flight times in s at which it was told something else."""

    values: dict[str, Value]
    internals_names: list[str]
    changed: tuple[float, ...]


def recorded_parameters(flight: Flight) -> dict[str, NodeRecord]:
    """Return {role: parameters} from what the nodes published, else from the parameter file attached to the bag.

    Raises TopicError if the bag has neither, CorruptError if they cannot be read.
    """
    try:
        if flight.has(TOPIC):
            return _published(flight)
        if flight.parameters:
            content = read_parameter_text(flight.parameters_text, str(flight.path))
            told = {pattern.rsplit("/", 1)[-1] for pattern in content} & set(ROLES)
            return {role: NodeRecord(overrides_for([content], role, flight.namespace or "/"), [], ()) for role in told}
    except (ParameterError, yaml.YAMLError) as error:
        raise CorruptError(f"{flight.path}: recorded parameters cannot be read: {error}") from error
    raise TopicError(f"{flight.path}: no topic {TOPIC!r} and no attached parameters: with which parameters is unknown")


def _published(flight: Flight) -> dict[str, NodeRecord]:
    found: dict[str, NodeRecord] = {}
    for row in flight.array(TOPIC):
        role = str(row["role"])
        if role not in ROLES:
            continue
        content = read_parameter_text(str(row["parameters"]), f"{flight.path}: {TOPIC}")
        values: dict[str, Value] = {}
        for body in content.values():
            values.update(body)
        before = found.get(role)
        names = [str(name) for name in row["internals_names"]]
        seconds = float(row["log_ns"]) * 1e-9
        if before is None or (seconds <= 0.0 and not before.changed):
            found[role] = NodeRecord(values, names, ())
        elif values != before.values:
            found[role] = before._replace(changed=(*before.changed, seconds))
    return found


def retold(
    flight: Flight, role: str, *, law: str | None = None, settings: Mapping[str, str] | None = None
) -> tuple[Resolved, bool]:
    """Return the parameters of a controller with another ``law`` or ``settings`` ({parameter: text}), and whether new.

    Another law starts from its defaults; flight, vehicle and period stay. Raises RecordedParametersError.
    """
    records = recorded_parameters(flight)
    if role not in records:
        raise RecordedParametersError(f"{flight.path}: {TOPIC} says nothing of {role}")
    values = dict(records[role].values)
    settings = dict(settings or {})
    wanted = settings.pop("law", None) or law or values.get("law")
    try:
        values = with_law(values, str(wanted))
        preset = settings.pop("preset", None)
        if preset is not None:
            values = {name: value for name, value in values.items() if not name.startswith(f"{wanted}.")}
            values["preset"] = preset
        values.update(typed(role, values, settings))
        before, after = records[role].values, resolve(role, values)
        told = {field.name: field.default for field in after.all_fields()}
        # Parameters that came after the bag have their defaults: nobody changed them.
        return after, any(told.get(name) != value for name, value in before.items())
    except (ParameterError, PluginError) as error:
        raise RecordedParametersError(f"{role}: {error}") from error
