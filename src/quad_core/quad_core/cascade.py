"""The cascade as one table: which stage answers the state, what it takes and gives, and which node it is.

    state, reference            -> position_controller -> attitude_setpoint     (eqs. 18-38)
    state, attitude_setpoint    -> attitude_controller -> wrench_setpoint       (eqs. 39-60)
    wrench_setpoint             -> the vehicle         -> state, actuation      (eqs. 1-17)

Everything that must know the stages derives it from here: plug-in groups, node parameters, topics, the nodes' inputs,
the loop without ROS, the log, the replay and the processes of ``fly``. Rows come from the packages, see
``quad_core.roles``, and stand in the order of the data flow; what the last row gives is what the vehicle follows.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from quad_core import node_parameters, plugins, roles
from quad_core.lift_off import with_lift_off
from quad_core.plugins import Wrapper
from quad_core.prediction import with_prediction
from quad_core.roles import PLANT_SLOTS, Role, Stage, VehicleInterface
from quad_core.types import Actuation, Disturbance, FlightMode, TrajectoryPoint, VehicleState

SIMULATOR = "simulator"
TRAJECTORY = "trajectory"
POSITION = "position_controller"
ATTITUDE = "attitude_controller"
RECORDER = "recorder"
RELAY = "odometry_relay"
COMMANDER = "commander"

STAGES = roles.in_order(tuple(roles.registered(roles.STAGES, Stage).values()))
"""The stages of the packages in this environment, in the order of the data flow."""

STAGE = {stage.role: stage for stage in STAGES}  # {role: its row}

WRAPPERS = (Wrapper(with_prediction, switch="prediction"), Wrapper(with_lift_off))
"""What stands around every law, the innermost first: prediction where its node asks for it, and lift-off."""

COMMAND, COMMANDING = STAGES[-1].output, STAGES[-1].role
"""The only topic that a vehicle follows, and the role that gives it."""


class Signal(NamedTuple):
    """A topic that carries a NamedTuple of ``quad_core.types``, one message per step of its publisher.

    ``readers``: roles that subscribe, in addition to the recorder and the stages that take it. ``instead``: the
    optional node that publishes it where it takes part. ``required``: without it there is no flight; another topic may
    be left out, a step topic then altogether. ``every_step`` false: it may cease, and the flight goes on. ``latched``:
    its newest message is kept for late subscribers. ``only_with``: the role without which a flight does not have it.
    """

    topic: str
    kind: type[Any]
    publisher: str
    paper: str = ""
    readers: tuple[str, ...] = ()
    instead: str = ""
    required: bool = False
    every_step: bool = True
    latched: bool = False
    only_with: str = ""


_STAGES = tuple(stage.role for stage in STAGES)
_HEARD = {POSITION: (COMMANDER,), COMMANDING: (SIMULATOR, COMMANDER)}
"""{stage: roles that read its output in addition to other stages}."""

SIGNALS = {
    signal.topic: signal
    for signal in (
        Signal("state", VehicleState, SIMULATOR, "x1..x12", (TRAJECTORY, COMMANDER, *_STAGES), RELAY, True),
        Signal("truth", VehicleState, SIMULATOR, "x1..x12 without noise or delay"),
        Signal("disturbance", Disturbance, SIMULATOR, "D_P, D_A of eqs. 10-12"),
        Signal("actuation", Actuation, SIMULATOR, "eqs. 3, 8", required=True),
        Signal("reference", TrajectoryPoint, TRAJECTORY, "eqs. 61-68", (TRAJECTORY,), COMMANDER, True),
        Signal(
            "mission/reference",
            TrajectoryPoint,
            TRAJECTORY,
            "eqs. 61-68",
            (COMMANDER,),
            required=True,
            every_step=False,
            only_with=COMMANDER,
        ),
        Signal(
            "flight/mode",
            FlightMode,
            COMMANDER,
            readers=(SIMULATOR, TRAJECTORY),
            required=True,
            latched=True,
            only_with=COMMANDER,
        ),
        *(
            Signal(stage.output, stage.output_type, stage.role, stage.paper, _HEARD.get(stage.role, ()), required=True)
            for stage in STAGES
        ),
        *(Signal(stage.internals_topic, stage.internals, stage.role, stage.paper) for stage in STAGES),
    )
}
"""{topic: what it carries}. A flight without ROS logs those that ``Row`` in quad_flight/loop.py has; the payload hash
covers the topics in ``STEP_TOPICS`` of quad_flight_log/payload_hash.py."""


ROLES = {
    SIMULATOR: Role("quad_dynamics", node_parameters.SimulatorParameters, PLANT_SLOTS),
    TRAJECTORY: Role("quad_trajectory", node_parameters.TrajectoryParameters, {"trajectory": plugins.TRAJECTORY}),
    **{stage.role: Role(stage.package, stage.parameters, {"law": stage.group}) for stage in STAGES},
    RECORDER: Role("quad_flight_log", node_parameters.RecorderParameters, {}),
}
"""The nodes of a flight."""

_RELAY = Role("quad_node", node_parameters.OdometryRelayParameters, {})
OPTIONAL_NODES = {RELAY: _RELAY, **roles.registered(roles.NODES, Role)}
"""Optional nodes; named in ``flight.roles`` they take part in the handshake."""

VEHICLE_INTERFACES = roles.registered(roles.VEHICLES, VehicleInterface)
"""Nodes that take the simulator's role in a flight: they own another vehicle, or an autopilot flies their plant."""

SHADOW = "shadow_"
SHADOWS = {SHADOW + stage.role: ROLES[stage.role] for stage in STAGES}
"""Second controllers that answer in parallel to the flying ones: recorded, but not used. A flight goes on without."""

ALL_ROLES: Mapping[str, Role | VehicleInterface] = {**ROLES, **OPTIONAL_NODES, **VEHICLE_INTERFACES, **SHADOWS}
