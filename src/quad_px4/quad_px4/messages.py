"""PX4's words over DDS: its modes, how it is asked, and the user's px4_msgs, whatever the release, from plain values.

The messages that the bridge uses are alike in releases 1.15 to 1.18 but for the names of some topics: a message with a
``MESSAGE_VERSION`` above 0 travels on a topic that ends with it.
"""

import importlib
import math
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any, NamedTuple

from quad_autopilot import frames
from quad_autopilot.autopilot import DO_SET_MODE, NAV_TAKEOFF, Ack, Autopilot, Control, Profile, Request
from quad_autopilot.odometry import Sample
from quad_core.parameters import ParameterError
from quad_core.types import Quat, Vec3
from quad_px4.mapping import ThrustTorque
from quad_px4.parameters import Mode

OFFBOARD, LANDING, TAKEOFF, LOITER = 14, (18, 12, 20), 17, 4
"""nav_state: offboard; land, descend, precision land; take-off; hold."""
ARMED, EXTERNAL1 = 2, 23
PROFILE = Profile(
    "PX4",
    "offboard",
    "vehicle_status",
    "vehicle_odometry",
    "is its uXRCE-DDS agent running?",
    Request(DO_SET_MODE, 1.0, 6.0),
    idle_hint="(COM_DISARM_PRFLT?)",
    hold=Request(DO_SET_MODE, 1.0, 4.0, 3.0),
)
MODE_LOSS = 1.5
"""Seconds within which PX4 to 1.17 misses an external mode that stopped: four arming checks and delays."""
POSITION_INVALID = "local_position_invalid"
LOSS_ADVICE = "set COM_OF_LOSS_T to 0.1 and COM_OBL_RC_ACT to 4 (Land), docs/how_to/px4.md"
"""What keeps a bridge, an agent or a computer that stops from crashing the vehicle in modes wrench and motors."""
NAV_STATES = {
    0: "MANUAL", 1: "ALTCTL", 2: "POSCTL", 3: "AUTO_MISSION", 4: "AUTO_LOITER", 5: "AUTO_RTL", 6: "POSITION_SLOW",
    10: "ACRO", 12: "DESCEND", 13: "TERMINATION", 14: "OFFBOARD", 15: "STAB", 17: "AUTO_TAKEOFF", 18: "AUTO_LAND",
    19: "AUTO_FOLLOW_TARGET", 20: "AUTO_PRECLAND", 21: "ORBIT", 22: "AUTO_VTOL_TAKEOFF",
}  # fmt: skip


def mode_name(nav_state: int) -> str:
    """Return PX4's name of a mode."""
    external = nav_state - EXTERNAL1 + 1
    return NAV_STATES.get(nav_state, f"EXTERNAL{external}" if 1 <= external <= 8 else f"mode {nav_state}")


class Flags(NamedTuple):
    """What the bridge reads of a FailsafeFlags: the flags that are set, and since when PX4 misses our stream.

    ``stream_lost``: None before the first message; ``lost_at`` in us of PX4.
    """

    reasons: tuple[str, ...] = ()
    stream_lost: bool | None = None
    lost_at: int = 0


def autopilot(
    status: Any, mode: Any, flags: Flags, landed: bool = False, battery: float = math.nan, external: int = -1
) -> Autopilot:
    """Return what PX4 says of itself: its controlling party by the newer of two messages, its reasons by the status.

    ``status``: VehicleStatus, at most 5 times a second; ``mode``: VehicleControlMode, at most 50 times, or None.
    ``external``: nav_state of our external mode, -1: offboard is ours. PX4 shows an external mode's own configuration
    while that mode is active, its number included. ``battery``: share of full, NaN unknown.
    """
    ours = external if external >= 0 else OFFBOARD
    name, whose, armed = mode_name(status.nav_state), control(status.nav_state, ours), status.arming_state == ARMED
    if mode is not None and mode.timestamp > status.timestamp:
        armed = bool(mode.flag_armed)
        if mode.source_id == external if external >= 0 else mode.flag_control_offboard_enabled:
            name, whose = mode_name(ours), Control.OURS
        elif whose == Control.OURS:
            name, whose = "not said yet", Control.UNSAID
    return Autopilot(
        name,
        whose,
        armed,
        failsafe=bool(status.failsafe),
        checks_pass=bool(status.pre_flight_checks_pass),
        reasons=flags.reasons,
        stream_lost=flags.stream_lost,
        lost_at=1e-6 * flags.lost_at,
        landed=landed,
        position_lost=POSITION_INVALID in flags.reasons,
        battery=battery,
    )


def control(nav_state: int, ours: int = OFFBOARD) -> Control:
    """Return whose the vehicle is in a mode."""
    known = {ours: Control.OURS, TAKEOFF: Control.CLIMBING, LOITER: Control.WAITING}
    return Control.LANDING if nav_state in LANDING else known.get(nav_state, Control.OTHER)


_COMPONENT = 1  # of our commands
_COMMAND = "timestamp param1 param2 param4 param5 param6 param7 command target_system target_component confirmation"
_FIELDS = {
    "OffboardControlMode": "timestamp attitude thrust_and_torque direct_actuator",
    "VehicleThrustSetpoint": "timestamp timestamp_sample xyz",
    "VehicleTorqueSetpoint": "timestamp timestamp_sample xyz",
    "ActuatorMotors": "timestamp timestamp_sample control",
    "VehicleAttitudeSetpoint": "timestamp yaw_sp_move_rate q_d thrust_body",
    "VehicleOdometry": " ".join(Sample._fields),
    "VehicleCommand": _COMMAND,
    "VehicleCommandAck": "command result target_system target_component",
    "VehicleStatus": "timestamp arming_state nav_state failsafe pre_flight_checks_pass",
    "VehicleControlMode": "timestamp flag_armed flag_control_offboard_enabled",
    "VehicleLandDetected": "landed",
    "BatteryStatus": "connected remaining",
    "FailsafeFlags": "timestamp offboard_control_signal_lost",
}
NEEDED = {name: tuple(fields.split()) for name, fields in _FIELDS.items()}  # {message: the fields that the bridge uses}

RELEASES = {(0, 0, 0): "1.15", (1, 0, 0): "1.16", (1, 1, 0): "1.17", (4, 1, 1): "1.18"}
"""{versions of VehicleStatus, VehicleAttitudeSetpoint, VehicleCommandAck: release}."""

SETPOINTS = {
    Mode.WRENCH: ("VehicleThrustSetpoint", "VehicleTorqueSetpoint"),
    Mode.MOTORS: ("ActuatorMotors",),
    Mode.ATTITUDE: ("VehicleAttitudeSetpoint",),
}
LEVELS = {Mode.WRENCH: "thrust_and_torque", Mode.MOTORS: "direct_actuator", Mode.ATTITUDE: "attitude"}
"""{mode: the field of OffboardControlMode that asks for it}."""


def load() -> ModuleType:
    """Return px4_msgs.msg; raises ParameterError if it is not there or lacks what the bridge needs."""
    try:
        module = importlib.import_module("px4_msgs.msg")
    except ImportError as error:
        raise ParameterError(
            f"px4_msgs: not found ({error}); put the branch of PX4's px4_msgs that fits your firmware (release/1.15 "
            "to release/1.18) into a ROS 2 workspace, build it and source it before the bridge"
        ) from error
    if lacking := missing(module, NEEDED):
        raise ParameterError(f"px4_msgs: {lacking} not found; expected a release of 1.15 to 1.18")
    return module


def missing(module: ModuleType, needed: Mapping[str, Sequence[str]]) -> str:
    """Return the first of the fields {message: fields} that a px4_msgs lacks; empty if it has all."""
    for name, fields in needed.items():
        known = getattr(module, name).get_fields_and_field_types() if hasattr(module, name) else {}
        if lacking := [field for field in fields if field not in known]:
            return f"{name}.{lacking[0]}"
    return ""


def version(message_type: Any) -> int:
    """Return the version of a message, or 0."""
    return int(getattr(message_type, "MESSAGE_VERSION", 0))


def release(module: ModuleType) -> str:
    """Return the release of PX4 that a px4_msgs belongs to."""
    key = (version(module.VehicleStatus), version(module.VehicleAttitudeSetpoint), version(module.VehicleCommandAck))
    return RELEASES.get(key, f"unknown (message versions {key})")


def topic(namespace: str, direction: str, message_type: Any) -> str:
    """Return the topic of a message; ``direction`` is as PX4 sees it, in or out."""
    words = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in message_type.__name__)
    ending = f"_v{version(message_type)}" if version(message_type) else ""
    return f"{'/' + namespace.strip('/') if namespace else ''}/fmu/{direction}/{words.lstrip('_')}{ending}"


def sample(message: Any) -> Sample:
    """Return a VehicleOdometry as plain numbers."""

    def plain(value: Any) -> Any:
        return tuple(value.tolist()) if hasattr(value, "tolist") else int(value)

    return Sample(*(plain(getattr(message, name)) for name in Sample._fields))


def flags(message: Any, before: Flags) -> Flags:
    """Return the names of the flags of a FailsafeFlags that are set, and since when PX4 misses our stream."""
    names = (name for name, kind in message.get_fields_and_field_types().items() if kind == "boolean")
    lost = bool(message.offboard_control_signal_lost)
    since = before.lost_at if lost and before.stream_lost else int(message.timestamp)
    return Flags(tuple(name for name in names if getattr(message, name)), lost, since)


def ack(message: Any, target: int) -> Ack | None:
    """Return a VehicleCommandAck as plain numbers; None for the answer to another's command, as a ground station's.

    ``target``: the system that our commands come from and go to.
    """
    is_ours = (message.target_system, message.target_component) == (target, _COMPONENT)
    return Ack(int(message.command), int(message.result)) if is_ours else None


def share(message: Any) -> float:
    """Return the share of full of a BatteryStatus, NaN if it is unknown."""
    known = message.connected and 0.0 <= message.remaining <= 1.0
    return float(message.remaining) if known else math.nan


def heartbeat(module: ModuleType, mode: Mode, timestamp: int) -> Any:
    """Return the OffboardControlMode of a mode; ``timestamp`` in microseconds of PX4, here and below."""
    message = module.OffboardControlMode(timestamp=timestamp)
    setattr(message, LEVELS[mode], True)
    return message


def command(module: ModuleType, request: Request, target: int, timestamp: int) -> Any:
    """Return the VehicleCommand of a request to system ``target``."""
    message = module.VehicleCommand(timestamp=timestamp, command=request.command, confirmation=request.attempt % 256)
    message.param1, message.param2, message.param3 = request.param1, request.param2, request.param3
    if request.command == NAV_TAKEOFF:  # here, to the height of MIS_TAKEOFF_ALT
        message.param4 = message.param5 = message.param6 = message.param7 = math.nan
    message.target_system = message.source_system = target
    message.target_component = message.source_component = _COMPONENT
    message.from_external = True
    return message


def thrust_torque(module: ModuleType, value: ThrustTorque, timestamp: int, sampled: int) -> tuple[Any, Any]:
    """Return the two setpoints of mode wrench; ``sampled``: stamp of the state they answer."""
    thrust = module.VehicleThrustSetpoint(timestamp=timestamp, timestamp_sample=sampled)
    torque = module.VehicleTorqueSetpoint(timestamp=timestamp, timestamp_sample=sampled)
    thrust.xyz, torque.xyz = list(value.thrust), list(value.torque)
    return thrust, torque


def motors(module: ModuleType, controls: list[float], timestamp: int, sampled: int) -> Any:
    """Return the setpoint of mode motors."""
    return module.ActuatorMotors(timestamp=timestamp, timestamp_sample=sampled, control=controls)


def attitude(module: ModuleType, q_wb: Quat, thrust: Vec3, timestamp: int) -> Any:
    """Return the setpoint of mode attitude for ``q_wb``, FLU in ENU, and a normalised thrust in FRD."""
    message, q = module.VehicleAttitudeSetpoint(timestamp=timestamp, yaw_sp_move_rate=math.nan), frames.attitude(q_wb)
    message.q_d, message.thrust_body = [q.w, q.x, q.y, q.z], list(thrust)
    return message
