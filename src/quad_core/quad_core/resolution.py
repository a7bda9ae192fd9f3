"""From {dotted name: value} to the parameter sets of a node, its plug-ins loaded; from ``--set`` text to such values.

Shared by the ROS nodes, the loop without ROS and the check of YAML files, so that all read a file alike.
"""

from collections.abc import Collection, Mapping, Sequence
from types import ModuleType
from typing import Any, NamedTuple

from quad_core import plugins
from quad_core.cascade import ALL_ROLES, COMMANDER, RELAY, SHADOW, SIMULATOR, STAGE, WRAPPERS
from quad_core.flight_parameters import FlightParameters
from quad_core.parameter_files import is_of_ros, plain_value
from quad_core.parameters import Field, ParameterError, Value, build, fields, flatten, nearest
from quad_core.plugins import PluginError, law_of
from quad_core.vehicle import Vehicle, check_inertia


class Plugin(NamedTuple):
    """A loaded plug-in with its resolved parameters; ``module``: of a stage that flies, the law in its wrappers."""

    name: str
    module: Any
    parameters: Any


class Resolved(NamedTuple):
    """All parameters of one node."""

    role: str
    flight: FlightParameters
    vehicle: Vehicle
    node: Any
    plugins: dict[str, Plugin]

    @property
    def law(self) -> Plugin:
        """The law of a stage as it flies: on predicted states where that is enabled, and with lift-off."""
        plugin = self.plugins["law"]
        law, parameters = law_of(plugin.module), plugin.parameters
        inputs: Any = STAGE[self.role.removeprefix(SHADOW)].inputs_type
        for wrapper in WRAPPERS:
            switch = getattr(self.node, wrapper.switch, None) if wrapper.switch else None
            if not wrapper.switch:
                law = wrapper.wrapped(law, inputs)
            elif switch is not None and switch.enabled:
                law = wrapper.wrapped(law, inputs)
                parameters = law.Parameters(parameters, switch)
        return plugin._replace(module=law, parameters=parameters)

    def all_fields(self) -> list[Field]:
        """Return every parameter of the node, dotted, with its resolved value as default."""
        found = list(fields(self.flight, "flight.")) + list(fields(self.vehicle, "vehicle.")) + list(fields(self.node))
        for slot, plugin in self.plugins.items():
            found += fields(plugin.parameters, f"{plugin.name}.", slot == "law")
        return found


def resolve(role: str, overrides: Mapping[str, Value]) -> Resolved:
    """Turn {dotted name: value} into the parameter sets of a node of ``role``.

    Raises ParameterError (unknown key, wrong type, out of range, NaN) or PluginError (no such plug-in).
    """
    kind = ALL_ROLES[role]
    left = {name: value for name, value in overrides.items() if not is_of_ros(name)}
    flight: FlightParameters = build(FlightParameters, _take(left, "flight."), "flight.")
    vehicle: Vehicle = build(Vehicle, _take(left, "vehicle."), "vehicle.")
    check_inertia(vehicle)
    own = {field.name for field in fields(kind.parameters)}
    node = build(kind.parameters, {name: left.pop(name) for name in list(left) if name in own})
    loaded = {}
    for slot, group in kind.slots.items():
        name = getattr(node, slot)
        try:
            module = plugins.load(group, name)
        except PluginError as error:
            raise PluginError(f"{slot}: {error}") from error
        start = build(module.Parameters, _preset(module, name, getattr(node, "preset", "tuned")), f"{name}.")
        parameters = build(start, _take(left, f"{name}."), f"{name}.")
        if hasattr(module, "check"):
            module.check(parameters)
        loaded[slot] = Plugin(name, module, parameters)
    if left:
        stray = sorted(left)[0]
        known = "flight.*, vehicle.*, " + ", ".join(sorted(own) + [f"{plugin.name}.*" for plugin in loaded.values()])
        every = Resolved(role, flight, vehicle, node, loaded).all_fields()
        meant = nearest(stray, [field.name for field in every])
        other = stray.partition(".")[0]
        for slot, group in kind.slots.items():
            if other in plugins.names(group):
                meant = f": its {slot} is {loaded[slot].name}, not {other}"
        raise ParameterError(f"{stray}: the {role} node has no such parameter{meant}; it has {known}")
    return Resolved(role, flight, vehicle, node, loaded)


def check_agreement(resolved: Mapping[str, Resolved]) -> None:
    """Raise ParameterError if two nodes of one flight differ in ``flight.*`` or ``vehicle.*``.

    How a plant differs from the nominal vehicle is in the plant's own parameters (eqs. 10-12).
    """
    first = resolved[SIMULATOR]
    for role, other in resolved.items():
        for prefix, mine, theirs in (("flight", first.flight, other.flight), ("vehicle", first.vehicle, other.vehicle)):
            expected, found = flatten(mine), flatten(theirs)
            for name, value in found.items():
                if value != expected[name]:
                    same = f"expected {expected[name]!r} as the simulator has it"
                    raise ParameterError(f"{role}: {prefix}.{name}: found {value!r}, {same}")


def _take(values: dict[str, Value], prefix: str) -> dict[str, Value]:
    return {name[len(prefix) :]: values.pop(name) for name in list(values) if name.startswith(prefix)}


def _preset(module: ModuleType, law: str, preset: str) -> Mapping[str, Value]:
    offered: Mapping[str, Mapping[str, Value]] = getattr(module, "PRESETS", {})
    if preset == "tuned" and preset not in offered:
        return {}
    if preset not in offered:
        known = ", ".join(sorted({"tuned", *offered}))
        raise ParameterError(f"preset: found {preset!r}, expected one that {law} offers: {known}")
    return offered[preset]


SHARED = ("flight", "vehicle")


def parse_settings(settings: Sequence[str], roles: Collection[str] = ALL_ROLES) -> dict[str, dict[str, Value]]:
    """Return {role or "/**": {parameter: value}} of NODE.PARAM=VALUE; NODE `flight` and `vehicle` mean all nodes.

    Raises ParameterError for another form, an unknown node, or one that is not among the flight's ``roles``.
    """
    found: dict[str, dict[str, Value]] = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        node, dot, parameter = name.partition(".")
        if not (equals and dot and parameter):
            raise ParameterError(f"--set {setting}: expected NODE.PARAM=VALUE")
        if node in SHARED:
            node, parameter = "/**", name
        elif node not in roles:
            known = ", ".join((*roles, *SHARED))
            raise ParameterError(f"--set {setting}: {_why_no_node(node)}; expected one of {known}")
        found.setdefault(node, {})[parameter] = plain_value(value)
    return found


def _why_no_node(node: str) -> str:
    if node not in ALL_ROLES:
        return f"no node {node!r}{nearest(node, (*ALL_ROLES, *SHARED))}"
    how = {RELAY: "with --relay", COMMANDER: "with --mission"}.get(node)
    how = how or ("with --shadow" if node.startswith(SHADOW) else "its parameters: the file of --vehicle-interface")
    return f"{node} has no part in this flight ({how})"


def with_law(values: Mapping[str, Value], law: str) -> dict[str, Value]:
    """Return the parameters of a controller with another law: it starts from its defaults, all else stays."""
    before = values.get("law")
    if law == before:
        return dict(values)
    others = {name: value for name, value in values.items() if before is None or not name.startswith(f"{before}.")}
    return {**others, "law": law, "preset": "tuned"}
