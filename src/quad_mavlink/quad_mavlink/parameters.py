"""The parameters of the bridge over MAVLink: where the autopilot is, what it is sent, when it is given up."""

from typing import Annotated, NamedTuple

from quad_autopilot.parameters import ArmingParameters, ResetLimit, RotorThrust, ThrustCurve, rates
from quad_core.node_parameters import GuardParameters
from quad_core.parameters import Real, Text, Whole
from quad_core.roles import VehicleInterface


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
