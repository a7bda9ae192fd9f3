"""The cascade as one table: which stage answers the state, what it takes and gives, and which node it is.

    state, reference            -> position_controller -> attitude_setpoint     (eqs. 18-38)
    state, attitude_setpoint    -> attitude_controller -> wrench_setpoint       (eqs. 39-60)
    wrench_setpoint             -> the vehicle         -> state, actuation      (eqs. 1-17)

Everything that must know the stages derives it from here: plug-in groups, node parameters, topics, the nodes' inputs,
the loop without ROS, the log, the replay and the processes of ``fly``. A new stage is its module, one row here and one
message of its internals. Rows stand in the order of the data flow; what the last row gives is what the vehicle obeys.
"""

from collections.abc import Collection
from typing import Any, NamedTuple

from quad_core import plugins
from quad_core.commander_parameters import CommanderParameters
from quad_core.crazyflie_parameters import CrazyflieBridgeParameters
from quad_core.hil_parameters import HilPlantParameters
from quad_core.joined_parameters import JoinedPlantParameters
from quad_core.mavlink_parameters import MavlinkBridgeParameters
from quad_core.node_parameters import (
    AttitudeControllerParameters,
    OdometryRelayParameters,
    PositionControllerParameters,
    RecorderParameters,
    SimulatorParameters,
    TrajectoryParameters,
)
from quad_core.px4_parameters import Px4BridgeParameters
from quad_core.types import (
    Actuation,
    AttitudeInputs,
    AttitudeInternals,
    AttitudeThrust,
    Disturbance,
    FlightMode,
    PositionInputs,
    PositionInternals,
    TrajectoryPoint,
    VehicleState,
    Wrench,
)

SIMULATOR = "simulator"
TRAJECTORY = "trajectory"
POSITION = "position_controller"
ATTITUDE = "attitude_controller"
RECORDER = "recorder"
RELAY = "odometry_relay"
COMMANDER = "commander"
PX4 = "px4_bridge"
MAVLINK = "mavlink_bridge"
CRAZYFLIE = "crazyflie_bridge"
HIL = "hil_plant"
JOINED = "joined_plant"


class Input(NamedTuple):
    """One input of a stage other than the state. ``lag`` in plant steps: 1 is the value of the step before."""

    topic: str
    lag: int = 0


class Stage(NamedTuple):
    """One law between reference and rotors, run by a node of its own.

    ``inputs`` is what its ``step`` gets: the state, then one field per row of ``takes``. ``internals`` is the class of
    the message that carries what the law computed; a law's own further numbers travel in its field ``extra``.
    """

    role: str
    package: str
    group: str
    parameters: type[Any]
    inputs: type[Any]
    takes: tuple[Input, ...]
    gives: str
    output: type[Any]
    internals: type[Any]
    paper: str

    @property
    def internals_topic(self) -> str:
        """Name of the topic that carries the internals."""
        return f"{self.role}/internals"


STAGES = (
    Stage(
        role=POSITION,
        package="quad_position_ctrl",
        group=plugins.POSITION_LAW,
        parameters=PositionControllerParameters,
        inputs=PositionInputs,
        takes=(Input("reference"), Input("actuation", lag=1)),
        gives="attitude_setpoint",
        output=AttitudeThrust,
        internals=PositionInternals,
        paper="eqs. 18-38",
    ),
    Stage(
        role=ATTITUDE,
        package="quad_attitude_ctrl",
        group=plugins.ATTITUDE_LAW,
        parameters=AttitudeControllerParameters,
        inputs=AttitudeInputs,
        takes=(Input("attitude_setpoint"), Input("actuation", lag=1)),
        gives="wrench_setpoint",
        output=Wrench,
        internals=AttitudeInternals,
        paper="eqs. 39-60",
    ),
)

STAGE = {stage.role: stage for stage in STAGES}
"""{role: its row}."""

COMMAND, COMMANDING = STAGES[-1].gives, STAGES[-1].role
"""The only topic that a vehicle obeys, and the role that gives it."""

GROUPS = {**{stage.group: plugins.LAW for stage in STAGES}, **plugins.OTHERS}
"""{group of plug-ins: what its modules hold}."""


class Signal(NamedTuple):
    """A topic with one message per step of its publisher, which carries a NamedTuple of ``quad_core.types``."""

    topic: str
    kind: type[Any]
    publisher: str
    paper: str = ""


SIGNALS = {
    signal.topic: signal
    for signal in (
        Signal("state", VehicleState, SIMULATOR, "x1..x12"),
        Signal("truth", VehicleState, SIMULATOR, "x1..x12 without noise or delay"),
        Signal("disturbance", Disturbance, SIMULATOR, "D_P, D_A of eqs. 10-12"),
        Signal("actuation", Actuation, SIMULATOR, "eqs. 3, 8"),
        Signal("reference", TrajectoryPoint, TRAJECTORY, "eqs. 61-68"),
        Signal("mission/reference", TrajectoryPoint, TRAJECTORY, "eqs. 61-68"),
        Signal("flight/mode", FlightMode, COMMANDER),
        *(Signal(stage.gives, stage.output, stage.role, stage.paper) for stage in STAGES),
        *(Signal(stage.internals_topic, stage.internals, stage.role, stage.paper) for stage in STAGES),
    )
}
"""{topic: what it carries}: all that a flight without ROS computes, too, but for the commander's two."""


class Role(NamedTuple):
    """One kind of node: its package, its parameters and which of them name plug-ins of which group."""

    package: str
    parameters: type[Any]
    slots: dict[str, str]


_PLANT_SLOTS = {"plant": plugins.PLANT, "disturbance": plugins.DISTURBANCE, "sensing": plugins.SENSING}

ROLES = {
    SIMULATOR: Role("quad_dynamics", SimulatorParameters, _PLANT_SLOTS),
    TRAJECTORY: Role("quad_trajectory", TrajectoryParameters, {"trajectory": plugins.TRAJECTORY}),
    **{stage.role: Role(stage.package, stage.parameters, {"law": stage.group}) for stage in STAGES},
    RECORDER: Role("quad_flight_log", RecorderParameters, {}),
}
"""The nodes of a flight."""

GUESTS = {
    RELAY: Role("quad_node", OdometryRelayParameters, {}),
    COMMANDER: Role("quad_commander", CommanderParameters, {}),
}
"""Nodes that a flight may have besides; named in ``flight.roles`` they take part in the handshake."""

OWNERS = {
    PX4: Role("quad_px4", Px4BridgeParameters, {}),
    CRAZYFLIE: Role("quad_crazyflie", CrazyflieBridgeParameters, {}),
    MAVLINK: Role("quad_mavlink", MavlinkBridgeParameters, {}),
    HIL: Role("quad_mavlink", HilPlantParameters, _PLANT_SLOTS),
    JOINED: Role("quad_mavlink", JoinedPlantParameters, _PLANT_SLOTS),
}
"""Nodes that take the simulator's role in a flight: they own another vehicle, or an autopilot flies their plant."""

SHADOW = "shadow_"
SHADOWS = {SHADOW + stage.role: ROLES[stage.role] for stage in STAGES}
"""Second controllers that answer in parallel to the flying ones: recorded, but not used."""


def replaceable(roles: Collection[str]) -> tuple[str, ...]:
    """Return the controllers among ``roles`` that have a shadow."""
    return tuple(role.removeprefix(SHADOW) for role in roles if role in SHADOWS)


ALL_ROLES = {**ROLES, **GUESTS, **OWNERS, **SHADOWS}


def takers(topic: str) -> tuple[str, ...]:
    """Return the roles of the stages that take a topic, in order; all take the state."""
    return tuple(
        stage.role for stage in STAGES if topic == "state" or any(taken.topic == topic for taken in stage.takes)
    )
