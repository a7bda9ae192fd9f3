"""What an autopilot says of itself, how it is asked, and what it answers: numbers as MAVLink and PX4 share them."""

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

DO_SET_MODE, ARM_DISARM, NAV_LAND, NAV_TAKEOFF, SET_NAV_STATE = 176, 400, 21, 22, 100_001
COMMANDS = {
    DO_SET_MODE: "DO_SET_MODE", ARM_DISARM: "COMPONENT_ARM_DISARM", NAV_LAND: "NAV_LAND", NAV_TAKEOFF: "NAV_TAKEOFF",
    SET_NAV_STATE: "SET_NAV_STATE",
}  # fmt: skip
FORCE = 21196.0  # second parameter of COMPONENT_ARM_DISARM: disarm in the air, too
IN_PROGRESS = 5
RESULTS = (
    "accepted", "temporarily rejected", "denied", "unsupported", "failed", "in progress", "cancelled",
)  # fmt: skip
_SHOWN = 6  # reasons in a line


class Control(IntEnum):
    """The party that controls the vehicle."""

    OTHER = 0
    OURS = 1
    LANDING = 2
    UNSAID = 3  # no longer ours; the autopilot has not yet said which mode took over
    CLIMBING = 4  # its own take-off
    WAITING = 5  # it holds its place, as after its own take-off


class Autopilot(NamedTuple):
    """What an autopilot says of itself; ``mode`` by its name there, ``reasons`` what speaks against a flight.

    ``stream_lost``: whether it misses our stream, None where it does not say so, and ``lost_at`` s of its time since
    when. ``landed``: its land detector sees the ground. ``battery``: share of full, NaN if it does not say.
    """

    mode: str
    control: Control
    armed: bool
    failsafe: bool = False
    checks_pass: bool = True
    reasons: tuple[str, ...] = ()
    stream_lost: bool | None = None
    lost_at: float = 0.0
    landed: bool = False
    position_lost: bool = False
    battery: float = math.nan


class Ack(NamedTuple):
    """The answer to a command."""

    command: int
    result: int


class Request(NamedTuple):
    """A command with its first three parameters; ``attempt`` counts from 0."""

    command: int
    param1: float = math.nan
    param2: float = math.nan
    param3: float = 0.0
    attempt: int = 0


class Stamps(NamedTuple):
    """Microseconds of the autopilot: now, and of the state that is answered."""

    now: int = 0
    sampled: int = 0


class Profile(NamedTuple):
    """How an autopilot is asked, and what its messages are called there.

    ``offboard`` names the mode in which it follows our setpoints, ``status`` and ``state`` the messages that say how it
    is and where the vehicle is, ``hint`` what to look for when they do not come. ``mode``: how that mode is asked for,
    None where a pilot chooses it; ``hold``: how it is told to hold its place, None where it cannot. ``loss_limit``: s
    within which it must notice a stream that stops before it is armed, 0: not tested; ``loss_advice``: what to set
    where it does not. ``idle_hint``: its parameter that disarms a vehicle that does not take off.
    """

    name: str
    offboard: str
    status: str
    state: str
    hint: str
    mode: Request | None
    arm: Request = Request(ARM_DISARM, 1.0)
    land: Request = Request(NAV_LAND)
    takeoff: Request = Request(NAV_TAKEOFF)
    disarm: Request = Request(ARM_DISARM, 0.0)
    hold: Request | None = None
    loss_limit: float = 0.0
    loss_advice: str = ""
    idle_hint: str = ""


def against(autopilot: Autopilot, usual: tuple[str, ...] = ()) -> str:
    """Return what speaks against a flight, without the ``usual`` reasons; empty if nothing does."""
    new = [reason for reason in autopilot.reasons if reason not in usual]
    return "; ".join(([] if autopilot.checks_pass else ["pre-flight checks fail"]) + ([listed(new)] if new else []))


def because(autopilot: Autopilot, usual: tuple[str, ...] = ()) -> str:
    """Return what is ``against`` a flight as a bracket that follows a text."""
    found = against(autopilot, usual)
    return f" ({found})" if found else ""


def listed(reasons: Sequence[str]) -> str:
    """Return reasons in one line, as many as it takes."""
    more = len(reasons) - _SHOWN
    return ", ".join(reasons[:_SHOWN]) + (f" and {more} more" if more > 0 else "")
