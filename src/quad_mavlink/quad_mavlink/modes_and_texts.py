"""What PX4 and ArduPilot say over MAVLink: their modes (HEARTBEAT), reasons (STATUSTEXT) and estimates.

Velocities of ODOMETRY are in the frame of ``child_frame_id``: PX4 sends NED (1), others body FRD (12). Without it an
ATTITUDE_QUATERNION and a LOCAL_POSITION_NED make a pair.
"""

import math
from typing import Any, NamedTuple

from quad_autopilot.autopilot import DO_SET_MODE, Autopilot, Control, Profile, Request
from quad_autopilot.odometry import NED, Sample
from quad_core.geometry import rotate
from quad_core.types import Quat, Vec3

ARDUPILOT, PX4 = 3, 12  # MAV_AUTOPILOT
ON_GROUND = 1  # MAV_LANDED_STATE
_ARMED, _CUSTOM_MODE = 128, 1.0
_CRITICAL = 5
_AUTO, _OFFBOARD, _LOITER = 4, 6, 3
_PX4_MODES = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 10: "TERMINATION"}
_PX4_AUTO = {
    1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW", 9: "PRECLAND",
    10: "VTOL_TAKEOFF",
}  # fmt: skip
_PX4_CONTROL = {2: Control.CLIMBING, 3: Control.WAITING, 6: Control.LANDING, 9: Control.LANDING}
_GUIDED, _LAND, _BRAKE = 4, 9, 17
_COPTER_MODES = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 5: "LOITER", 6: "RTL", 7: "CIRCLE", 9: "LAND",
    11: "DRIFT", 13: "SPORT", 14: "FLIP", 15: "AUTOTUNE", 16: "POSHOLD", 17: "BRAKE", 18: "THROW", 19: "AVOID_ADSB",
    20: "GUIDED_NOGPS", 21: "SMART_RTL", 22: "FLOWHOLD", 23: "FOLLOW", 24: "ZIGZAG", 25: "SYSTEMID",
}  # fmt: skip

UNKNOWN = Profile("the autopilot", "offboard", "HEARTBEAT", "estimate", "does its MAVLink reach `listen`?", Request(0))
"""Before the first HEARTBEAT."""
PROFILES = {
    PX4: Profile(
        "PX4",
        "OFFBOARD",
        "HEARTBEAT",
        "ODOMETRY",
        "does the link send it?",
        Request(DO_SET_MODE, _CUSTOM_MODE, float(_OFFBOARD)),
        idle_hint="(COM_DISARM_PRFLT?)",
        hold=Request(DO_SET_MODE, _CUSTOM_MODE, float(_AUTO), float(_LOITER)),
    ),
    ARDUPILOT: Profile(
        "ArduPilot",
        "GUIDED",
        "HEARTBEAT",
        "ATTITUDE_QUATERNION, LOCAL_POSITION_NED",
        "does the link send it?",
        Request(DO_SET_MODE, _CUSTOM_MODE, float(_GUIDED)),
        idle_hint="(DISARM_DELAY?)",
        hold=Request(DO_SET_MODE, _CUSTOM_MODE, float(_BRAKE)),
    ),
}


def said(
    heartbeat: Any, checks_pass: bool, reasons: tuple[str, ...], battery: float = math.nan, landed: bool = False
) -> Autopilot:
    """Return what a HEARTBEAT of PX4 or ArduPilot says; ``landed``: what its land detector does."""
    name, control = (_px4 if heartbeat.autopilot == PX4 else _copter)(heartbeat.custom_mode)
    armed, critical = bool(heartbeat.base_mode & _ARMED), heartbeat.system_status >= _CRITICAL
    return Autopilot(name, control, armed, critical, checks_pass, reasons, landed=landed, battery=battery)


def _px4(custom_mode: int) -> tuple[str, Control]:
    main, sub = custom_mode >> 16 & 255, custom_mode >> 24 & 255
    if main == _AUTO:
        return f"AUTO_{_PX4_AUTO.get(sub, sub)}", _PX4_CONTROL.get(sub, Control.OTHER)
    return _PX4_MODES.get(main, f"mode {main}"), Control.OURS if main == _OFFBOARD else Control.OTHER


def _copter(custom_mode: int) -> tuple[str, Control]:
    control = {_GUIDED: Control.OURS, _LAND: Control.LANDING}.get(custom_mode, Control.OTHER)
    return _COPTER_MODES.get(custom_mode, f"mode {custom_mode}"), control


WORST = 4  # MAV_SEVERITY_WARNING: what is less severe is no reason
_FOR, _SHOWN, _PIECE = 10.0, 3, 50


class Text(NamedTuple):
    """One text: when it came (s), its number (0: whole) and what it says."""

    at: float
    number: int
    text: str


def heard(texts: tuple[Text, ...], now: float, severity: int, text: str, number: int) -> tuple[Text, ...]:
    """Return the texts with a piece that has come; a piece of a known number is appended to it."""
    recent = tuple(known for known in texts if now - known.at <= _FOR)
    if severity > WORST or not text:
        return recent
    for place, known in enumerate(recent):
        if number and known.number == number and len(known.text) % _PIECE == 0:
            return (*recent[:place], known._replace(text=known.text + text), *recent[place + 1 :])
    # a reason that is said again is as new as it is now
    return (*(known for known in recent if known.text != text), Text(now, number, text))


def newest(texts: tuple[Text, ...], now: float) -> tuple[str, ...]:
    """Return the newest texts."""
    return tuple(known.text for known in texts if now - known.at <= _FOR)[-_SHOWN:]


LOCAL_NED, BODY_FRD = 1, 12  # MAV_FRAME
LATEST = 0.03  # seconds between the two messages of a pair
_OTHER = 0


def of_odometry(message: Any) -> Sample:
    """Return an ODOMETRY as a sample; one that is not NED is marked so."""
    velocity, child = (message.vx, message.vy, message.vz), message.child_frame_id
    if child == BODY_FRD:
        w, x, y, z = message.q
        turned = rotate(Quat(x, y, z, w), Vec3(*velocity))
        velocity, child = (turned.x, turned.y, turned.z), LOCAL_NED
    pose, motion = (NED if each == LOCAL_NED else _OTHER for each in (message.frame_id, child))
    stamp, position, q = message.time_usec, (message.x, message.y, message.z), tuple(message.q)
    return Sample(stamp, stamp, pose, motion, position, q, velocity, _rates(message), message.reset_counter)


def of_pair(message: Any, position: Any | None) -> Sample | None:
    """Return an ATTITUDE_QUATERNION with the newest LOCAL_POSITION_NED carried on to its time; None if none is near."""
    elapsed = 1e-3 * (message.time_boot_ms - position.time_boot_ms) if position is not None else math.inf
    if position is None or abs(elapsed) > LATEST:
        return None
    velocity = position.vx, position.vy, position.vz
    x, y, z = (p + elapsed * v for p, v in zip((position.x, position.y, position.z), velocity, strict=True))
    stamp, q = 1000 * message.time_boot_ms, (message.q1, message.q2, message.q3, message.q4)
    return Sample(stamp, stamp, NED, NED, (x, y, z), q, velocity, _rates(message), None)


def _rates(message: Any) -> tuple[float, float, float]:
    return message.rollspeed, message.pitchspeed, message.yawspeed
