"""PX4 and ArduPilot over MAVLink: how each is asked, and what its HEARTBEAT says."""

import math
from typing import NamedTuple

from quad_autopilot.autopilot import DO_SET_MODE, Autopilot, Control, Profile, Request

ARDUPILOT, PX4 = 3, 12
"""MAV_AUTOPILOT."""
_ARMED, _CUSTOM_MODE = 128, 1.0
_CRITICAL = 5
_AUTO, _OFFBOARD = 4, 6
_PX4_MODES = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED"}
_PX4_AUTO = {2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW", 9: "PRECLAND"}
_PX4_CONTROL = {2: Control.CLIMBING, 3: Control.WAITING, 6: Control.LANDING, 9: Control.LANDING}
_GUIDED, _LAND = 4, 9
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
    ),
    ARDUPILOT: Profile(
        "ArduPilot",
        "GUIDED",
        "HEARTBEAT",
        "ATTITUDE_QUATERNION, LOCAL_POSITION_NED",
        "does the link send it?",
        Request(DO_SET_MODE, _CUSTOM_MODE, float(_GUIDED)),
    ),
}


class Heartbeat(NamedTuple):
    """The fields of HEARTBEAT that are used, as MAVLink has them."""

    autopilot: int
    base_mode: int
    custom_mode: int
    system_status: int


def said(heartbeat: Heartbeat, checks_pass: bool, reasons: tuple[str, ...], battery: float = math.nan) -> Autopilot:
    """Return what a HEARTBEAT of PX4 or ArduPilot says."""
    name, control = (_px4 if heartbeat.autopilot == PX4 else _copter)(heartbeat.custom_mode)
    armed, critical = bool(heartbeat.base_mode & _ARMED), heartbeat.system_status >= _CRITICAL
    return Autopilot(name, control, armed, critical, checks_pass, reasons, battery=battery)


def _px4(custom_mode: int) -> tuple[str, Control]:
    main, sub = custom_mode >> 16 & 255, custom_mode >> 24 & 255
    if main == _AUTO:
        return f"AUTO_{_PX4_AUTO.get(sub, sub)}", _PX4_CONTROL.get(sub, Control.OTHER)
    return _PX4_MODES.get(main, f"mode {main}"), Control.OURS if main == _OFFBOARD else Control.OTHER


def _copter(custom_mode: int) -> tuple[str, Control]:
    control = {_GUIDED: Control.OURS, _LAND: Control.LANDING}.get(custom_mode, Control.OTHER)
    return _COPTER_MODES.get(custom_mode, f"mode {custom_mode}"), control
