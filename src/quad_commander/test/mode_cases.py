"""The mode table as a person wrote it, from what each mode is for, and how each condition comes about."""

from quad_commander import modes
from quad_commander.mode_table import Condition
from quad_commander.modes import Inputs, Memory
from quad_commander.parameters import ModeParameters
from quad_core.enumerations import GuardMode, GuardReason, Mode, Request
from quad_core.types import GuardStatus

LETTERS = {
    "D": Mode.DISARMED,
    "A": Mode.ARMING,
    "T": Mode.TAKEOFF,
    "M": Mode.MISSION,
    "H": Mode.HOLD,
    "L": Mode.LAND,
    "S": Mode.DESCEND,
    "P": Mode.PILOT,
    "K": Mode.KILL,
}
SEVERITY = list(LETTERS.values()).index
"""How severe a mode is: the later letter wins."""

# Columns: the mode before, in the order of the letters.
GRID = """
REFERENCE_LATE        D A T H H L S P K
REFERENCE_LOST        D A T L L L S P K
SETPOINT_LOST         D D S S S S S P K
STATE_LOST            D D S S S S S P K
STATE_REFUSED         D D L L L L S P K
POSITION_LOST         D D S S S S S P K
POSITION_ERROR        D D L L L L S P K
LARGE_POSITION_ERROR  D D S S S S S P K
FENCE                 D D L L L L S P K
BATTERY_LOW           D D L L L L S P K
ESTIMATOR_RESET       D D H H H L S P K
OVERRUNS              D D H H H L S P K
RECORDER_LOST         D D L L L L S P K
GUARD_DESCENDS        D D S S S S S P K
GUARD_KILLED          K K K K K K K P K
PILOT_TOOK_OVER       P P P P P P P P K
END_ASKED             D D L L L L S P K
TAKEOFF_LATE          D A L M H L S P K
LANDING_LATE          D A T M H S S P K
ARMING_LATE           D D T M H L S P K
READY                 D T T M H L S P K
AT_HEIGHT             D A H M H L S P K
PLAN_ENDED            D A T H H L S P K
CONTACT               D A T M H D D P K
"""
EXPECTED = {
    (mode, Condition[name]): LETTERS[letter]
    for name, *letters in map(str.split, GRID.strip().splitlines())
    for mode, letter in zip(LETTERS.values(), letters, strict=True)
}

HEALTH = {
    Condition.REFERENCE_LATE: {"reference_age": 0.21},
    Condition.REFERENCE_LOST: {"reference_age": 2.1},
    Condition.SETPOINT_LOST: {"setpoint_age": 0.31},
    Condition.STATE_LOST: {"state_age": 0.101},
    Condition.STATE_REFUSED: {"guard": GuardStatus(land=True)},
    Condition.POSITION_LOST: {"position_good": False},
    Condition.POSITION_ERROR: {"position_error": 1.6},
    Condition.LARGE_POSITION_ERROR: {"position_error": 2.6},
    Condition.FENCE: {"outside_fence": True},
    Condition.BATTERY_LOW: {"battery": 0.19},
    Condition.ESTIMATOR_RESET: {"estimator_reset": True},
    Condition.OVERRUNS: {"overruns": 0.06},
    Condition.RECORDER_LOST: {"recorder_lost": True},
    Condition.GUARD_DESCENDS: {"guard": GuardStatus(mode=GuardMode.DESCEND, condition=GuardReason.WRENCH_LOST)},
    Condition.GUARD_KILLED: {"guard": GuardStatus(mode=GuardMode.KILL, condition=GuardReason.STATE_GONE)},
    Condition.PILOT_TOOK_OVER: {"pilot": True},
    Condition.END_ASKED: {"end_asked": "Ctrl-C"},
}
"""Faults that can be raised in any mode in the air, by what is observed."""

PARAMETERS = ModeParameters(land_without_recorder=True)
LONG = 0.6
"""A step so long that every timer of a fault has run out after it."""


def health(*conditions, **changes):
    """Return what is observed when ``conditions`` are raised."""
    seen, report = {}, {}
    for condition in conditions:
        seen |= HEALTH[condition]
        report |= {name: value for name, value in seen.get("guard", GuardStatus())._asdict().items() if value}
    return Inputs(**{**seen, "guard": GuardStatus(**report), **changes})


def in_mode(mode, **changes):
    """Return the memory in the middle of ``mode``; a HOLD is one that waits for its mission."""
    waits = mode in (Mode.MISSION, Mode.HOLD)
    return Memory(mode, in_mission=waits, time=5.0)._replace(**changes)


def after(memory, *conditions, request=Request.NONE, dt=LONG, **changes):
    """Return (decision, memory) of one step with ``conditions`` raised."""
    return modes.step(PARAMETERS, memory, health(*conditions, **changes), request, dt)
