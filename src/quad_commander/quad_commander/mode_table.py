"""The mode table: which mode follows when a condition is raised or a request is made. Everything else is made from it.

``TABLE[mode][condition]`` and ``GRANTED[request][mode]`` are modes. ``docs/reference/modes.md`` shows both, the tests
walk them, and ``modes.step`` follows them. The rows below are the source.
"""

from enum import IntEnum
from typing import NamedTuple

from quad_core.cascade import POSITION, TRAJECTORY
from quad_core.enumerations import Mode, Request


class Condition(IntEnum):
    """What can be wrong, what is late, then what is achieved (from READY on). Versions differ in their numbers."""

    REFERENCE_LATE = 0
    REFERENCE_LOST = 1
    SETPOINT_LOST = 2
    STATE_LOST = 3
    STATE_REFUSED = 4
    POSITION_LOST = 5
    POSITION_ERROR = 6
    LARGE_POSITION_ERROR = 7
    FENCE = 8
    BATTERY_LOW = 9
    ESTIMATOR_RESET = 10
    OVERRUNS = 11
    RECORDER_LOST = 12
    GUARD_DESCENDS = 13
    GUARD_KILLED = 14
    PILOT_TOOK_OVER = 15
    END_ASKED = 16
    TAKEOFF_LATE = 17
    LANDING_LATE = 18
    ARMING_LATE = 19
    READY = 20
    AT_HEIGHT = 21
    PLAN_ENDED = 22
    CONTACT = 23


class Fault(NamedTuple):
    """One condition: the limit in words, the mode that follows in the air, whether it lasts until disarmed.

    ``text`` may name parameters in braces. ``only``: the modes in which it means anything; empty: all in the air.
    ``on_ground``: the mode that follows in ARMING. ``publisher``: the role that is silent where the row is about
    silence.
    """

    condition: Condition
    text: str
    then: Mode
    only: tuple[Mode, ...] = ()
    lasts: bool = False
    on_ground: Mode = Mode.DISARMED
    publisher: str = ""


class ModeRow(NamedTuple):
    """A mode: the larger ``severity`` wins. ``by_reference``: the laws follow the reference of the commander.

    ``in_the_air``: what is wrong, and most requests, lead on from it.
    """

    severity: int
    in_the_air: bool = False
    by_reference: bool = False


MODES = {
    Mode.DISARMED: ModeRow(0),
    Mode.ARMING: ModeRow(10),
    Mode.TAKEOFF: ModeRow(20, in_the_air=True, by_reference=True),
    Mode.MISSION: ModeRow(30, in_the_air=True, by_reference=True),
    Mode.HOLD: ModeRow(40, in_the_air=True, by_reference=True),
    Mode.LAND: ModeRow(50, in_the_air=True, by_reference=True),
    Mode.DESCEND: ModeRow(60, in_the_air=True),
    Mode.PILOT: ModeRow(70),
    Mode.KILL: ModeRow(80),
}
IN_THE_AIR = tuple(mode for mode, row in MODES.items() if row.in_the_air)
BY_REFERENCE = tuple(mode for mode, row in MODES.items() if row.by_reference)


def severity(mode: Mode) -> int:
    """Return how severe ``mode`` is."""
    return MODES[mode].severity


_LATE = "mission reference older than {reference_late:g} s"
_STALE = "attitude setpoint older than {setpoint_lost:g} s"
_LOST = "mission reference older than {reference_lost:g} s, also while holding for it"

FAULTS = (
    Fault(Condition.REFERENCE_LATE, _LATE, Mode.HOLD, (Mode.MISSION,), False, Mode.ARMING, TRAJECTORY),
    Fault(Condition.REFERENCE_LOST, _LOST, Mode.LAND, (Mode.MISSION, Mode.HOLD), False, Mode.ARMING, TRAJECTORY),
    Fault(Condition.SETPOINT_LOST, _STALE, Mode.DESCEND, BY_REFERENCE, publisher=POSITION),
    Fault(Condition.STATE_LOST, "state older than {state_lost:g} s", Mode.DESCEND),
    Fault(Condition.STATE_REFUSED, "many states refused, position good", Mode.LAND),
    Fault(Condition.POSITION_LOST, "position cannot be trusted", Mode.DESCEND),
    Fault(Condition.POSITION_ERROR, "position error above {position_error:g} m", Mode.LAND, BY_REFERENCE),
    Fault(
        Condition.LARGE_POSITION_ERROR, "position error above {large_position_error:g} m", Mode.DESCEND, BY_REFERENCE
    ),
    Fault(Condition.FENCE, "outside the fence", Mode.LAND),
    Fault(Condition.BATTERY_LOW, "battery below {battery_low:.0%}", Mode.LAND, lasts=True),
    Fault(Condition.ESTIMATOR_RESET, "estimator reset", Mode.HOLD),
    Fault(Condition.OVERRUNS, "more than {overruns:.0%} of the commander's cycles of a second late", Mode.HOLD),
    Fault(Condition.RECORDER_LOST, "recorder lost, and asked to land then", Mode.LAND),
    Fault(Condition.GUARD_DESCENDS, "the guard flies its backup law", Mode.DESCEND),
    Fault(Condition.GUARD_KILLED, "guard stopped the motors", Mode.KILL, on_ground=Mode.KILL),
    Fault(Condition.PILOT_TOOK_OVER, "a pilot took over", Mode.PILOT, on_ground=Mode.PILOT),
    Fault(Condition.END_ASKED, "Ctrl-C, SIGTERM, or whoever started the flight is gone", Mode.LAND, lasts=True),
)
"""What is wrong. The more severe mode wins; none leads to a less severe one."""

PROGRESS = (
    (Mode.ARMING, Condition.ARMING_LATE, Mode.DISARMED, "no take-off within {arming_late:g} s"),
    (Mode.ARMING, Condition.READY, Mode.TAKEOFF, "checks passed, take-off asked for, {spool_up:g} s of spool-up"),
    (Mode.TAKEOFF, Condition.AT_HEIGHT, Mode.HOLD, "at the height of take-off"),
    (Mode.TAKEOFF, Condition.TAKEOFF_LATE, Mode.LAND, "not at height after {takeoff_late:g} s"),
    (Mode.MISSION, Condition.PLAN_ENDED, Mode.HOLD, "the trajectory has ended"),
    (Mode.LAND, Condition.CONTACT, Mode.DISARMED, "the guard sees the vehicle stand on the ground"),
    (Mode.LAND, Condition.LANDING_LATE, Mode.DESCEND, "no contact {landing_late:g} s after the landing ended"),
    (Mode.DESCEND, Condition.CONTACT, Mode.DISARMED, "the same, or the guard has landed"),
)
"""What is achieved, or not in time: the only way on without a request. Of one mode the first row wins."""

GRANTED: dict[Request, dict[Mode, Mode]] = {
    Request.ARM: {Mode.DISARMED: Mode.ARMING, Mode.ARMING: Mode.ARMING},
    Request.TAKEOFF: {Mode.DISARMED: Mode.ARMING, Mode.ARMING: Mode.ARMING},
    Request.MISSION: {Mode.HOLD: Mode.MISSION},
    Request.HOLD: dict.fromkeys(IN_THE_AIR, Mode.HOLD),
    Request.GOTO: dict.fromkeys(IN_THE_AIR, Mode.HOLD),
    Request.LAND: dict.fromkeys(IN_THE_AIR, Mode.LAND),
    Request.DESCEND: dict.fromkeys(IN_THE_AIR, Mode.DESCEND),
    Request.DISARM: {Mode.DISARMED: Mode.DISARMED, Mode.ARMING: Mode.DISARMED, Mode.PILOT: Mode.DISARMED},
    Request.KILL: dict.fromkeys(Mode, Mode.KILL),
}
"""What a request leads to; not named: refused. DISARM in PILOT needs contact. GOTO is a HOLD at the place it names."""


def _row(mode: Mode) -> dict[Condition, Mode]:
    following = dict.fromkeys(Condition, mode)
    for fault in FAULTS:
        if mode == Mode.ARMING:
            following[fault.condition] = fault.on_ground
        elif mode in (fault.only or IN_THE_AIR):
            following[fault.condition] = max(mode, fault.then, key=severity)
    if mode == Mode.DISARMED:
        following[Condition.GUARD_KILLED] = Mode.KILL
        following[Condition.PILOT_TOOK_OVER] = Mode.PILOT
    return following | {condition: then for here, condition, then, _ in PROGRESS if here == mode}


TABLE = {mode: _row(mode) for mode in Mode}
LASTING = frozenset(row.condition for row in FAULTS if row.lasts)
