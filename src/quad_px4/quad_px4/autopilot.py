"""PX4's own words over DDS: its modes and how it is asked."""

from typing import NamedTuple

from quad_autopilot.autopilot import DO_SET_MODE, Autopilot, Control, Profile, Request

OFFBOARD, LANDING = 14, (18, 12, 20)
"""nav_state: offboard; land, descend, precision land."""
ARMED = 2
PROFILE = Profile(
    "PX4",
    "offboard",
    "vehicle_status",
    "vehicle_odometry",
    "is its uXRCE-DDS agent running?",
    Request(DO_SET_MODE, 1.0, 6.0),
)
NAV_STATES = {
    0: "MANUAL", 1: "ALTCTL", 2: "POSCTL", 3: "AUTO_MISSION", 4: "AUTO_LOITER", 5: "AUTO_RTL", 10: "ACRO",
    12: "DESCEND", 13: "TERMINATION", 14: "OFFBOARD", 15: "STAB", 17: "AUTO_TAKEOFF", 18: "AUTO_LAND",
    20: "AUTO_PRECLAND", 21: "ORBIT",
}  # fmt: skip


def mode_name(nav_state: int) -> str:
    """Return PX4's name of a mode."""
    return NAV_STATES.get(nav_state, f"mode {nav_state}")


class Status(NamedTuple):
    """What the bridge reads of a VehicleStatus, which PX4 sends at most 5 times a second; ``timestamp`` in us."""

    timestamp: int
    nav_state: int
    arming_state: int
    failsafe: bool
    checks_pass: bool


class ControlMode(NamedTuple):
    """What the bridge reads of a VehicleControlMode, at most 50 times a second; ``timestamp`` in us."""

    timestamp: int
    armed: bool
    offboard: bool


def autopilot(status: Status, mode: ControlMode | None, reasons: str) -> Autopilot:
    """Return what PX4 says of itself: whose the vehicle is by the newer of the two messages, why by the status."""
    name, whose, armed = mode_name(status.nav_state), control(status.nav_state), status.arming_state == ARMED
    if mode is not None and mode.timestamp > status.timestamp:
        armed = mode.armed
        if mode.offboard:
            name, whose = mode_name(OFFBOARD), Control.OURS
        elif whose == Control.OURS:
            name, whose = "not said yet", Control.UNSAID
    return Autopilot(name, whose, armed, status.failsafe, status.checks_pass, reasons)


def control(nav_state: int) -> Control:
    """Return whose the vehicle is in a mode."""
    return Control.OURS if nav_state == OFFBOARD else Control.LANDING if nav_state in LANDING else Control.OTHER
