"""The px4_msgs that the user has: found at start, whatever the release, and filled from plain values.

The messages that the bridge uses are alike in releases 1.15 to 1.18 but for the names of some topics: a message with a
``MESSAGE_VERSION`` above 0 travels on a topic that ends with it.
"""

import importlib
import math
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

from quad_autopilot import frames
from quad_autopilot.autopilot import NAV_TAKEOFF, Ack, Request
from quad_autopilot.odometry import Sample
from quad_core.parameters import ParameterError
from quad_core.types import Quat, Vec3
from quad_px4.autopilot import Flags
from quad_px4.mapping import ThrustTorque
from quad_px4.parameters import Mode

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
NEEDED = {name: tuple(fields.split()) for name, fields in _FIELDS.items()}
"""{message: the fields that the bridge uses}."""

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
