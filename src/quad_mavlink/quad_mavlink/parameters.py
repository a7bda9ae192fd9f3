"""The parameters of the bridge over MAVLink, and of our plant under PX4 that our own laws fly."""

from typing import Annotated, NamedTuple

from quad_autopilot.parameters import ArmingParameters, ResetLimit, RotorThrust, ThrustCurve, rates
from quad_core.node_parameters import GuardParameters
from quad_core.parameters import Real, Text, Whole
from quad_core.roles import PLANT_SLOTS, VehicleInterface
from quad_px4.parameters import LossLimit


class MavlinkBridgeParameters(NamedTuple):
    """The bridge over MAVLink: where the autopilot is, what it is sent, and when it is given up."""

    listen: Annotated[str, Text("host:port that takes UDP; 0.0.0.0: from other machines, too")] = "127.0.0.1:14540"
    connect: Annotated[str, Text("host:port of an autopilot that waits for a message; empty: the bridge waits")] = ""
    target_system: Annotated[int, Whole("", "the autopilot's system number", 1, 255, "MAV_SYS_ID, SYSID_THISMAV")] = 1
    source_system: Annotated[int, Whole("", "the bridge's number, for GCS failsafes", 1, 255, "MAV_GCS_SYSID")] = 255
    state_interval: Annotated[float, Real("s", "spacing of states", 0.002, 0.1, "SET_MESSAGE_INTERVAL")] = 0.01
    max_rotor_thrust: RotorThrust = 0.0
    autopilot_curve: Annotated[float, Real("", "its curve; 0: linear", 0.0, 1.0, "THR_MDL_FAC, MOT_THST_EXPO")] = 0.0
    thrust_curve: ThrustCurve = 0.0
    reset_limit: ResetLimit = 0.3
    arming: ArmingParameters = ArmingParameters()
    guard: GuardParameters = GuardParameters()


MAVLINK = "mavlink_bridge"
INTERFACE = VehicleInterface(
    "quad_mavlink",
    MavlinkBridgeParameters,
    {},
    "mavlink",
    "docs/how_to/mavlink.md",
    rates(4_000_000),
    autopilot_lands=True,
)


class GateParameters(NamedTuple):
    """How long, by the clock on the wall, the plant waits for PX4's states and the controllers (``gate.*``)."""

    settle: Annotated[float, Real("s", "wait for outputs after a reading in offboard mode", 0.0, 1.0)] = 0.002
    linger: Annotated[float, Real("s", "wait for outputs after a wrench, or a state that may be due", 0.0, 1.0)] = 0.01
    overdue: Annotated[float, Real("s", "wait for a state that is due; then an event", 0.01, 600.0)] = 2.0
    answer_timeout: Annotated[float, Real("s", "wait for outputs and controllers; then failed", 0.1, 600.0)] = 10.0


class JoinedPlantParameters(NamedTuple):
    """The plant under PX4's simulator interface and the bridge to PX4 in one vehicle interface."""

    plant: Annotated[str, Text("plug-in of group quad.plant")] = "rigid_body"
    disturbance: Annotated[str, Text("plug-in of group quad.disturbance")] = "none"
    sensing: Annotated[str, Text("plug-in of group quad.sensing; not used: `state` is PX4's estimate")] = "sensor"
    listen: Annotated[str, Text("host:port for PX4; 0.0.0.0: from other machines, too")] = "127.0.0.1:4560"
    namespace: Annotated[str, Text("prefix of /fmu, equal to UXRCE_DDS_NS; empty: none", "UXRCE_DDS_NS")] = ""
    target_system: Annotated[int, Whole("", "PX4's system number", 1, 255, "MAV_SYS_ID")] = 1
    thrust_curve: ThrustCurve = 0.0
    reset_limit: ResetLimit = 0.3
    loss_limit: LossLimit = 0.25
    truth_period_steps: Annotated[int, Whole("steps", "between two HIL_STATE_QUATERNION", 1, 1000)] = 5
    gate: GateParameters = GateParameters()
    arming: ArmingParameters = ArmingParameters()
    guard: GuardParameters = GuardParameters()


JOINED = "joined_plant"
_AGES = ("reference_late", "reference_lost", "setpoint_lost", "state_lost")
JOINED_INTERFACE = VehicleInterface(
    "quad_mavlink",
    JoinedPlantParameters,
    PLANT_SLOTS,
    "joined",
    "docs/how_to/px4.md",
    (
        *rates(4_000_000),
        # s of wall time: the plant waits for the autopilot, so nothing ages meanwhile
        "position_controller.input_timeout=60",
        "attitude_controller.input_timeout=60",
        *(f"commander.modes.{age}=60" for age in _AGES),
    ),
    autopilot_lands=True,
    flies_on_estimate=True,
)
