"""PX4's own words: its modes, commands and answers, and what it says of itself."""

import math
from typing import NamedTuple

OFFBOARD, LANDING = 14, (18, 12, 20)
"""nav_state: offboard; land, descend, precision land."""
ARMED = 2
DO_SET_MODE, ARM_DISARM, NAV_LAND = 176, 400, 21
COMMANDS = {DO_SET_MODE: "DO_SET_MODE", ARM_DISARM: "COMPONENT_ARM_DISARM", NAV_LAND: "NAV_LAND"}
ACCEPTED, IN_PROGRESS = 0, 5
RESULTS = (
    "accepted", "temporarily rejected", "denied", "unsupported", "failed", "in progress", "cancelled",
)  # fmt: skip
NAV_STATES = {
    0: "MANUAL", 1: "ALTCTL", 2: "POSCTL", 3: "AUTO_MISSION", 4: "AUTO_LOITER", 5: "AUTO_RTL", 10: "ACRO",
    12: "DESCEND", 13: "TERMINATION", 14: "OFFBOARD", 15: "STAB", 17: "AUTO_TAKEOFF", 18: "AUTO_LAND",
    20: "AUTO_PRECLAND", 21: "ORBIT",
}  # fmt: skip


class Autopilot(NamedTuple):
    """What PX4 says of itself: VehicleStatus, and in ``reasons`` the flags that speak against a flight."""

    nav_state: int
    arming_state: int
    failsafe: bool = False
    checks_pass: bool = True
    reasons: str = ""


class Ack(NamedTuple):
    """A VehicleCommandAck."""

    command: int
    result: int


class Request(NamedTuple):
    """A VehicleCommand with its first two parameters; ``attempt`` counts from 0."""

    command: int
    param1: float = math.nan
    param2: float = math.nan
    attempt: int = 0


def mode_name(autopilot: Autopilot | None) -> str:
    """Return PX4's name of its mode."""
    return "unknown" if autopilot is None else NAV_STATES.get(autopilot.nav_state, f"mode {autopilot.nav_state}")


def taken(autopilot: Autopilot, when: str) -> str:
    """Return who took the mode away ``when``, with what PX4 says."""
    who = "PX4's failsafe" if autopilot.failsafe else "a pilot or PX4"
    return f"{who} took the vehicle {when}: mode {mode_name(autopilot)}{because(autopilot)}"


def because(autopilot: Autopilot) -> str:
    """Return what speaks against a flight, in brackets; empty if nothing."""
    said = ([] if autopilot.checks_pass else ["pre-flight checks fail"]) + (
        [autopilot.reasons] if autopilot.reasons else []
    )
    return f" ({'; '.join(said)})" if said else ""
