"""PX4's own words over DDS: its modes and how it is asked."""

import math
from typing import Any, NamedTuple

from quad_autopilot.autopilot import DO_SET_MODE, Autopilot, Control, Profile, Request

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
MODE_LOSS = 1.3
"""Seconds within which PX4 to 1.17 misses an external mode that stopped: the fourth arming check, 0.3 s apart."""
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
