"""What each node can be told, and how overrides become parameter sets.

Shared by the ROS nodes, the loop without ROS and the check of YAML files, so that all read a file alike.
"""

from collections.abc import Mapping
from types import ModuleType
from typing import Annotated, Any, NamedTuple

from quad_core import plugins
from quad_core.parameters import Choice, Field, Flag, ParameterError, Real, Text, Value, Whole, build, fields, flatten
from quad_core.vehicle import Vehicle

LOCKSTEP = 0
REALTIME = 1


class FlightParameters(NamedTuple):
    """Shared by all nodes of one flight (``flight.*``)."""

    mode: Annotated[
        int,
        Choice(("lockstep", "realtime"), "lockstep: the plant waits for every command; realtime: nodes act on arrival"),
    ] = LOCKSTEP
    run_id: Annotated[str, Text("identifies the run; nodes of another run are refused; empty accepts any")] = ""
    seed: Annotated[int, Whole("", "seed of every random stream of the flight", 0, 2**31 - 1)] = 1
    plant_period: Annotated[
        int, Whole("ns", "time between two states; every rate divides the plant's", 100_000, 1_000_000_000)
    ] = 2_000_000
    roles: Annotated[str, Text("roles that take part, comma separated; all must be ready before step 0")] = (
        "simulator,trajectory,position_controller,attitude_controller,recorder"
    )
    start_timeout: Annotated[
        float, Real("s", "wall-clock time that a node waits for the others before the flight", 0.5, 3600.0, live=False)
    ] = 60.0
    silence_timeout: Annotated[
        float,
        Real(
            "s", "wall-clock time without any sign of the flight after which a node gives up", 1.0, 3600.0, live=False
        ),
    ] = 20.0
    realtime_priority: Annotated[
        int,
        Whole("", "real time: SCHED_FIFO priority of plant and controllers if the system permits it; 0: none", 0, 99),
    ] = 40
    machine_code: Annotated[
        bool,
        Flag("laws and plant as machine code where scripts/fly has built it: faster, and the same bits", live=False),
    ] = True


class SimulatorParameters(NamedTuple):
    """The simulator node: plant, disturbance, sensing and the lockstep it keeps."""

    plant: Annotated[str, Text("plug-in of group quad.plant; its parameters stand under its name")] = "rigid_body"
    disturbance: Annotated[str, Text("plug-in of group quad.disturbance; its parameters stand under its name")] = (
        "held_gaussian"
    )
    sensing: Annotated[str, Text("plug-in of group quad.sensing; its parameters stand under its name")] = "sensor"
    window: Annotated[
        int, Whole("steps", "how far the plant may run ahead of what the recorder has acknowledged", 1, 200)
    ] = 60
    repeat_after: Annotated[
        float, Real("s", "wall-clock time without an answer after which a state is repeated", 0.05, 60.0, live=False)
    ] = 0.5
    repeat_limit: Annotated[int, Whole("", "repeats of one state before the flight fails", 1, 1000)] = 6
    odom_period_steps: Annotated[int, Whole("steps", "odometry for tools once in so many steps", 1, 100_000)] = 10
    clock_period_steps: Annotated[int, Whole("steps", "/clock once in so many steps", 1, 100_000)] = 5
    publish_state: Annotated[
        bool, Flag("false: another node, such as odometry_relay, makes `state`, here from odom", live=False)
    ] = True
    command_timeout: Annotated[
        float,
        Real("s", "real time: age of the newest wrench after which the rotors are stopped", 0.002, 60.0, live=False),
    ] = 0.1
    loss_timeout: Annotated[
        float, Real("s", "real time: age of the newest wrench after which the flight fails", 0.01, 600.0, live=False)
    ] = 1.0


class TrajectoryParameters(NamedTuple):
    """The trajectory node."""

    trajectory: Annotated[str, Text("plug-in of group quad.trajectory; its parameters stand under its name")] = "hover"
    period_steps: Annotated[int, Whole("steps", "plant steps between two references", 1, 100_000)] = 5


class PositionControllerParameters(NamedTuple):
    """The position controller node."""

    law: Annotated[str, Text("plug-in of group quad.position_law; its parameters stand under its name")] = "aibs"
    preset: Annotated[str, Text("starting values of the law's parameters: tuned (its defaults) or one it offers")] = (
        "tuned"
    )
    period_steps: Annotated[int, Whole("steps", "plant steps between two attitude setpoints", 1, 100_000)] = 5
    input_timeout: Annotated[
        float, Real("s", "real time: age of the reference after which the position is held", 0.01, 60.0, live=False)
    ] = 0.2


class AttitudeControllerParameters(NamedTuple):
    """The attitude controller node."""

    law: Annotated[str, Text("plug-in of group quad.attitude_law; its parameters stand under its name")] = "abfnitsm"
    preset: Annotated[str, Text("starting values of the law's parameters: tuned (its defaults) or one it offers")] = (
        "tuned"
    )
    period_steps: Annotated[int, Whole("steps", "plant steps between two wrenches", 1, 100_000)] = 1
    input_timeout: Annotated[
        float, Real("s", "real time: age of the setpoint after which the vehicle is levelled", 0.01, 60.0, live=False)
    ] = 0.1


class RecorderParameters(NamedTuple):
    """The recorder node."""

    directory: Annotated[
        str, Text("directory of the bag; must not exist or be empty; empty: flights/<run id or time>")
    ] = ""
    parameters_file: Annotated[str, Text("resolved parameters of the flight, attached to the bag; empty: none")] = ""
    ack_steps: Annotated[
        int, Whole("steps", "steps between two acknowledgements; below the simulator's window", 1, 199)
    ] = 20
    finish_timeout: Annotated[
        float, Real("s", "wall-clock time to wait for missing messages after the flight", 0.1, 600.0, live=False)
    ] = 10.0


class OdometryRelayParameters(NamedTuple):
    """The odometry relay: an estimator's nav_msgs/Odometry as `state`."""

    odometry: Annotated[str, Text("topic of the estimator's nav_msgs/Odometry; twist in the body frame (REP 105)")] = (
        "odom"
    )
    world_frame: Annotated[str, Text("header.frame_id that is accepted (ENU); empty: any")] = "map"
    body_frame: Annotated[str, Text("child_frame_id that is accepted (FLU); empty: any")] = "base_link"
    stamps: Annotated[
        int,
        Choice(("flight", "first"), "flight: stamps count from step 0, as the simulator's; first: from the first one"),
    ] = 0


class Role(NamedTuple):
    """One kind of node: its own parameters and which of them name plug-ins of which group."""

    parameters: type[Any]
    slots: dict[str, str]


ROLES = {
    "simulator": Role(
        SimulatorParameters,
        {"plant": plugins.PLANT, "disturbance": plugins.DISTURBANCE, "sensing": plugins.SENSING},
    ),
    "trajectory": Role(TrajectoryParameters, {"trajectory": plugins.TRAJECTORY}),
    "position_controller": Role(PositionControllerParameters, {"law": plugins.POSITION_LAW}),
    "attitude_controller": Role(AttitudeControllerParameters, {"law": plugins.ATTITUDE_LAW}),
    "recorder": Role(RecorderParameters, {}),
}

"""The five nodes of a flight."""

GUESTS = {"odometry_relay": Role(OdometryRelayParameters, {})}
"""Nodes that a flight may have besides; named in ``flight.roles`` they take part in the handshake."""

SHADOW = "shadow_"
SHADOWS = {SHADOW + role: ROLES[role] for role in ("position_controller", "attitude_controller")}
"""Second controllers that answer beside the flying ones: recorded, obeyed by nobody."""

ALL_ROLES = {**ROLES, **GUESTS, **SHADOWS}


class Plugin(NamedTuple):
    """A loaded plug-in with its resolved parameters."""

    name: str
    module: ModuleType
    parameters: Any


class Resolved(NamedTuple):
    """All that one node was told."""

    role: str
    flight: FlightParameters
    vehicle: Vehicle
    node: Any
    plugins: dict[str, Plugin]

    def all_fields(self) -> list[Field]:
        """Return every parameter of the node, dotted, with its resolved value as default."""
        found = list(fields(self.flight, "flight.")) + list(fields(self.vehicle, "vehicle.")) + list(fields(self.node))
        for plugin in self.plugins.values():
            found += fields(plugin.parameters, f"{plugin.name}.")
        return found


def resolve(role: str, overrides: Mapping[str, Value]) -> Resolved:
    """Turn {dotted name: value} into the parameter sets of a node of ``role``.

    Raises ParameterError (unknown key, wrong type, out of range, NaN) or PluginError (no such plug-in).
    """
    kind = ALL_ROLES[role]
    left = dict(overrides)
    flight: FlightParameters = build(FlightParameters, _take(left, "flight."), "flight.")
    vehicle: Vehicle = build(Vehicle, _take(left, "vehicle."), "vehicle.")
    own = {field.name for field in fields(kind.parameters)}
    node = build(kind.parameters, {name: left.pop(name) for name in list(left) if name in own})
    loaded = {}
    for slot, group in kind.slots.items():
        name = getattr(node, slot)
        module = plugins.load(group, name)
        start = build(module.Parameters, _preset(module, name, getattr(node, "preset", "tuned")), f"{name}.")
        parameters = build(start, _take(left, f"{name}."), f"{name}.")
        if hasattr(module, "check"):
            module.check(parameters)
        loaded[slot] = Plugin(name, module, parameters)
    if left:
        stray = sorted(left)[0]
        known = "flight.*, vehicle.*, " + ", ".join(sorted(own) + [f"{plugin.name}.*" for plugin in loaded.values()])
        raise ParameterError(f"{stray}: the {role} node has no such parameter; it has {known}")
    return Resolved(role, flight, vehicle, node, loaded)


def check_agreement(resolved: Mapping[str, Resolved]) -> None:
    """Raise ParameterError if two nodes of one flight differ in ``flight.*`` or ``vehicle.*``.

    A plant that differs from the nominal vehicle is told so by its own parameters (eqs. 10-12).
    """
    first = resolved["simulator"]
    for role, other in resolved.items():
        for prefix, mine, theirs in (("flight", first.flight, other.flight), ("vehicle", first.vehicle, other.vehicle)):
            expected, found = flatten(mine), flatten(theirs)
            for name, value in found.items():
                if value != expected[name]:
                    raise ParameterError(
                        f"{role}: {prefix}.{name}: found {value!r}, expected {expected[name]!r} as the simulator has it"
                    )


def _take(values: dict[str, Value], prefix: str) -> dict[str, Value]:
    return {name[len(prefix) :]: values.pop(name) for name in list(values) if name.startswith(prefix)}


def _preset(module: ModuleType, law: str, preset: str) -> Mapping[str, Value]:
    offered: Mapping[str, Mapping[str, Value]] = getattr(module, "PRESETS", {})
    if preset == "tuned" and preset not in offered:
        return {}
    if preset not in offered:
        raise ParameterError(
            f"preset: found {preset!r}, expected one that {law} offers: {', '.join({'tuned', *offered})}"
        )
    return offered[preset]
