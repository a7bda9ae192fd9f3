"""Which mode the vehicle is in: one pure step over the mode table.

A node calls ``step`` at its rate (100 Hz) and needs nothing else to decide:

    decision, memory = modes.step(parameters, memory, health, request, dt)
    # decision.guard_request goes to the vehicle interface
    if decision.changed: plan the mode's reference from the current one (quad_commander.references)

Per step: first what is achieved moves on, then the request is answered, then the most severe of what is wrong wins.
A mode is left for a less severe one only by request, and a request into a mode that a raised condition would leave at
once is refused, naming the condition. KILL is final; PILOT ends on the ground only, by DISARM, and asks for nothing.
"""

from typing import NamedTuple

from quad_commander.mode_table import ANSWERS, FAULT_COUNT, LASTING, TABLE, Condition, Mode, Request
from quad_commander.parameters import ModeParameters
from quad_guard.guard import ASK_DESCEND, ASK_KILL, NO_REQUEST, RELEASE
from quad_guard.guard import DESCEND as GUARD_DESCEND
from quad_guard.guard import GOOD as GUARD_GOOD
from quad_guard.guard import KILL as GUARD_KILL
from quad_guard.guard import PASS as GUARD_PASS
from quad_guard.guard import REQUESTED as GUARD_REQUESTED

DISARMED, ARMING, TAKEOFF, MISSION, HOLD, LAND, DESCEND, PILOT, KILL = (mode.value for mode in Mode)
# fmt: off
(
    REFERENCE_LATE, REFERENCE_LOST, SETPOINT_LOST, STATE_LOST,
    STATE_REFUSED, POSITION_LOST, POSITION_ERROR, LARGE_POSITION_ERROR,
    FENCE, BATTERY_LOW, ESTIMATOR_RESET, OVERRUNS, RECORDER_LOST,
    GUARD_DESCENDS, GUARD_KILLED, PILOT_TOOK_OVER, END_ASKED, TAKEOFF_LATE, LANDING_LATE,
    ARMING_LATE, READY, AT_HEIGHT, PLAN_ENDED, CONTACT,
) = (condition.value for condition in Condition)
# fmt: on
CONDITIONS = len(Condition)
FLAGS = tuple(1 << condition.value for condition in Condition)
NO_REASON = -1
ON_REQUEST = -2
"""Reasons that are no condition: none yet, and on request."""

NOT_ASKED = 0
DONE = 1
NOT_DONE = 2


class Health(NamedTuple):
    """What the commander observes in one step; the defaults are a healthy vehicle in the air.

    Ages in s (steps times period in lockstep, steady clock in real time); ``reference_age`` is that of the mission's.
    ``guard_mode``, ``guard_condition``, ``guard_land``: see ``quad_guard.guard.Report``; ``contact``: the guard, or the
    vehicle itself, sees it stand. ``position_error``: distance from the reference in m. ``battery``: share of full, 1
    if unknown. ``reference_done``: the reference of this mode has come to rest at its end, ``done_time`` s ago.
    ``checks_passed``: see ``arming``.
    """

    reference_age: float = 0.0
    setpoint_age: float = 0.0
    state_age: float = 0.0
    guard_mode: int = GUARD_PASS
    guard_condition: int = GUARD_GOOD
    guard_land: bool = False
    contact: bool = False
    position_good: bool = True
    position_error: float = 0.0
    outside_fence: bool = False
    battery: float = 1.0
    estimator_reset: bool = False
    overruns: float = 0.0
    recorder_lost: bool = False
    pilot: bool = False
    end_asked: bool = False
    checks_passed: bool = False
    plan_ended: bool = False
    reference_done: bool = False
    done_time: float = 0.0


class Timers(NamedTuple):
    """For how long in s this mode holds; time in s left for the guard to give back."""

    mode: float = 0.0
    release: float = 0.0


class Memory(NamedTuple):
    """What is remembered: mode and reason, lasting conditions, whether a mission runs or waits, a wish to take off."""

    mode: int = DISARMED
    reason: int = NO_REASON
    lasting: int = 0
    in_mission: bool = False
    takeoff_asked: bool = False
    timers: Timers = Timers()


class Decision(NamedTuple):
    """The mode, why (a Condition or ON_REQUEST), what is raised (one bit per Condition), and the request's answer.

    ``answer``: NOT_ASKED, DONE or NOT_DONE; ``blocked_by`` is the condition that forbids the request, or NO_REASON.
    ``guard_request`` is what the vehicle interface asks of the guard.
    """

    mode: int
    reason: int
    changed: bool
    raised: int
    answer: int
    blocked_by: int
    guard_request: int


def init() -> Memory:
    """Return the memory before the first step: disarmed."""
    return Memory(DISARMED, NO_REASON, 0, False, False, Timers(0.0, 0.0))


def step(
    parameters: ModeParameters, memory: Memory, health: Health, request: int, dt: float
) -> tuple[Decision, Memory]:
    """Return the decision of one step of ``dt`` s and the next memory. ``request`` is a ``Request``."""
    left = memory.timers.release - dt
    timers = Timers(memory.timers.mode + dt, left if left > 0.0 else 0.0)
    raised = memory.lasting | conditions(parameters, memory, health, timers)
    mode, reason = memory.mode, memory.reason
    for condition in range(FAULT_COUNT, CONDITIONS):
        if raised & FLAGS[condition] and TABLE[mode][condition] != mode:
            mode, reason = TABLE[mode][condition], condition
            break
    answer, blocked_by = NOT_ASKED, NO_REASON
    if request != Request.NONE:
        answer, blocked_by = asked(mode, request, raised)
        if answer == DONE and mode != ANSWERS[mode][request]:
            mode, reason = ANSWERS[mode][request], ON_REQUEST
    worst = most_severe(mode, raised)
    if worst != NO_REASON:
        mode, reason = TABLE[mode][worst], worst
    changed = mode != memory.mode
    in_mission = mode == MISSION or (mode == HOLD and memory.in_mission and reason != ON_REQUEST)
    takeoff_asked = mode == ARMING and (memory.takeoff_asked or (request == Request.TAKEOFF and answer == DONE))
    release = timers.release if TAKEOFF <= mode <= LAND else 0.0
    if memory.mode == DESCEND and TAKEOFF <= mode <= LAND:
        release = parameters.release_time
    after = Memory(
        mode,
        reason,
        0 if mode == DISARMED else lasting(raised),
        in_mission and reason != PLAN_ENDED,
        takeoff_asked,
        Timers(0.0 if changed else timers.mode, release),
    )
    return Decision(mode, reason, changed, raised, answer, blocked_by, guard_request(mode, release)), after


def conditions(parameters: ModeParameters, memory: Memory, health: Health, timers: Timers) -> int:
    """Return what is raised now, one bit per Condition."""
    found = faults_of_inputs(parameters, memory, health) | faults_of_flight(parameters, health)
    mode, time = memory.mode, timers.mode
    found |= flag(TAKEOFF_LATE, mode == TAKEOFF and time > parameters.takeoff_late)
    found |= flag(LANDING_LATE, mode == LAND and health.done_time > parameters.landing_late)
    found |= flag(ARMING_LATE, mode == ARMING and time > parameters.arming_late)
    ready = health.checks_passed and memory.takeoff_asked and time >= parameters.spool_up
    found |= flag(READY, mode == ARMING and ready)
    found |= flag(AT_HEIGHT, mode == TAKEOFF and health.reference_done)
    found |= flag(PLAN_ENDED, mode == MISSION and health.plan_ended)
    return found | flag(CONTACT, health.contact)


def faults_of_inputs(parameters: ModeParameters, memory: Memory, health: Health) -> int:
    """Return what is wrong with what arrives, and what the guard, the pilot and the starter of the flight say."""
    waits = memory.mode == MISSION or memory.in_mission
    found = flag(REFERENCE_LATE, waits and health.reference_age > parameters.reference_late)
    found |= flag(REFERENCE_LOST, waits and health.reference_age > parameters.reference_lost)
    found |= flag(SETPOINT_LOST, health.setpoint_age > parameters.setpoint_lost)
    found |= flag(STATE_LOST, health.state_age > parameters.state_lost)
    found |= flag(STATE_REFUSED, health.guard_land)
    found |= flag(POSITION_LOST, not health.position_good)
    found |= flag(ESTIMATOR_RESET, health.estimator_reset)
    found |= flag(OVERRUNS, health.overruns > parameters.overruns)
    found |= flag(RECORDER_LOST, health.recorder_lost and parameters.land_without_recorder)
    # once it descends on request the guard's mode says nothing new: what is wrong now does
    wrong = health.guard_condition != GUARD_GOOD and health.guard_condition != GUARD_REQUESTED
    unseen = memory.mode != DESCEND and memory.timers.release <= 0.0
    descends = health.guard_mode == GUARD_DESCEND and (wrong or unseen)
    found |= flag(GUARD_DESCENDS, descends)
    found |= flag(GUARD_KILLED, health.guard_mode == GUARD_KILL)
    found |= flag(PILOT_TOOK_OVER, health.pilot)
    return found | flag(END_ASKED, health.end_asked)


def faults_of_flight(parameters: ModeParameters, health: Health) -> int:
    """Return what is wrong with where the vehicle is and what it has left."""
    found = flag(POSITION_ERROR, health.position_error > parameters.position_error)
    found |= flag(LARGE_POSITION_ERROR, health.position_error > parameters.large_position_error)
    found |= flag(FENCE, health.outside_fence)
    return found | flag(BATTERY_LOW, health.battery < parameters.battery_low)


def flag(condition: int, is_raised: bool) -> int:
    """Return the bit of ``condition`` if it is raised, else 0."""
    return FLAGS[condition] if is_raised else 0


def asked(mode: int, request: int, raised: int) -> tuple[int, int]:
    """Return DONE or NOT_DONE, and the condition that forbids ``request``."""
    target = ANSWERS[mode][request]
    if target < 0:
        return NOT_DONE, NO_REASON
    if mode == PILOT and request == Request.DISARM and not raised & FLAGS[CONTACT]:
        return NOT_DONE, NO_REASON
    if target < mode or target == ARMING:
        blocking = most_severe(target, raised)
        if blocking != NO_REASON and target != DISARMED:
            return NOT_DONE, blocking
    return DONE, NO_REASON


def most_severe(mode: int, raised: int) -> int:
    """Return the raised fault that leads from ``mode`` to the most severe other mode, or NO_REASON."""
    worst, found = -1, NO_REASON
    for condition in range(FAULT_COUNT):
        following = TABLE[mode][condition]
        if raised & FLAGS[condition] and following != mode and following > worst:
            worst, found = following, condition
    return found


def lasting(raised: int) -> int:
    """Return the raised conditions that last until the vehicle is disarmed."""
    remaining = 0
    for condition in range(CONDITIONS):
        if LASTING[condition]:
            remaining |= raised & FLAGS[condition]
    return remaining


def guard_request(mode: int, release: float) -> int:
    """Return what is asked of the guard in ``mode``; it gives back only after a request, within ``release`` s."""
    if mode == KILL:
        return ASK_KILL
    if mode == DESCEND:
        return ASK_DESCEND
    return RELEASE if release > 0.0 else NO_REQUEST
