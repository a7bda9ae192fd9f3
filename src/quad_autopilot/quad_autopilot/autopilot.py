"""What an autopilot says of itself, how it is asked, and what it answers: numbers as MAVLink and PX4 share them."""

import math
from enum import IntEnum
from typing import NamedTuple

DO_SET_MODE, ARM_DISARM, NAV_LAND = 176, 400, 21
COMMANDS = {DO_SET_MODE: "DO_SET_MODE", ARM_DISARM: "COMPONENT_ARM_DISARM", NAV_LAND: "NAV_LAND"}
ACCEPTED, IN_PROGRESS = 0, 5
RESULTS = (
    "accepted", "temporarily rejected", "denied", "unsupported", "failed", "in progress", "cancelled",
)  # fmt: skip


class Control(IntEnum):
    """Whose the vehicle is."""

    OTHER = 0
    OURS = 1
    LANDING = 2
    UNSAID = 3
    """Not ours any more; whose it is has not come yet."""


class Autopilot(NamedTuple):
    """What an autopilot says of itself; ``mode`` by its name there, ``reasons`` what speaks against a flight."""

    mode: str
    control: Control
    armed: bool
    failsafe: bool = False
    checks_pass: bool = True
    reasons: str = ""


class Ack(NamedTuple):
    """The answer to a command."""

    command: int
    result: int


class Request(NamedTuple):
    """A command with its first two parameters; ``attempt`` counts from 0."""

    command: int
    param1: float = math.nan
    param2: float = math.nan
    attempt: int = 0


class Stamps(NamedTuple):
    """Microseconds of the autopilot: now, and of the state that is answered."""

    now: int = 0
    sampled: int = 0


class Profile(NamedTuple):
    """How an autopilot is asked, and what its messages are called there.

    ``offboard`` names the mode in which it obeys us, ``status`` and ``state`` the messages that say how it is and
    where the vehicle is, ``hint`` what to look for when they do not come.
    """

    name: str
    offboard: str
    status: str
    state: str
    hint: str
    mode: Request
    arm: Request = Request(ARM_DISARM, 1.0)
    land: Request = Request(NAV_LAND)


def taken(profile: Profile, autopilot: Autopilot, when: str) -> str:
    """Return who took the mode away ``when``, with what the autopilot says."""
    who = f"{profile.name}'s failsafe" if autopilot.failsafe else f"a pilot or {profile.name}"
    return f"{who} took the vehicle {when}: mode {autopilot.mode}{because(autopilot)}"


def because(autopilot: Autopilot) -> str:
    """Return what speaks against a flight, in brackets; empty if nothing."""
    said = ([] if autopilot.checks_pass else ["pre-flight checks fail"]) + (
        [autopilot.reasons] if autopilot.reasons else []
    )
    return f" ({'; '.join(said)})" if said else ""
