"""Which mode the vehicle is in: one pure step over the mode table.

A node calls ``step`` at its rate (100 Hz) and needs nothing else to decide:

    decision, memory = modes.step(parameters, memory, health, request, dt)
    # decision.guard_request goes to the vehicle interface
    if decision.changed: plan the mode's reference from the current one (quad_commander.references)

Per step: first what is achieved moves on, then the request is answered, then the most severe of what is wrong wins.
A mode is left for a less severe one only by request, and a request into a mode that a raised condition would leave at
once is refused, naming the condition. KILL is final; PILOT ends on the ground only, by DISARM, and asks for nothing.
"""

import math
from collections.abc import Set
from typing import NamedTuple

from quad_commander.mode_table import FAULTS, GRANTED, LASTING, PROGRESS, TABLE, Condition, Mode, Request
from quad_commander.parameters import ModeParameters
from quad_core.cascade import ATTITUDE
from quad_core.parameters import fields
from quad_core.types import GuardStatus
from quad_guard import guard

NO_REASON, ON_REQUEST = -1, -2
"""Reasons that are no condition: none yet, and on request."""
NOT_ASKED, DONE, NOT_DONE = 0, 1, 2


class Health(NamedTuple):
    """What the commander observes in one step; the defaults are a healthy vehicle in the air.

    Ages in s (steps times period in lockstep, steady clock in real time); ``reference_age`` is that of the mission's.
    ``guard``: its last report. ``landed``: the vehicle itself says that it stands. ``position_error``: distance from
    the reference in m. ``battery``: share of full, 1 if unknown. ``reference_done``: the reference of this mode has
    come to rest at its end, ``done_time`` s ago. ``checks_passed``: see ``preflight``.
    """

    reference_age: float = 0.0
    setpoint_age: float = 0.0
    state_age: float = 0.0
    guard: GuardStatus = GuardStatus()
    landed: bool = False
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


class Memory(NamedTuple):
    """What is remembered: mode and reason, lasting conditions, whether a mission runs or waits, a wish to take off.

    ``time``: for how long in s this mode holds; ``release``: time in s left for the guard to give back.
    """

    mode: Mode = Mode.DISARMED
    reason: int = NO_REASON
    lasting: Set[Condition] = frozenset()
    in_mission: bool = False
    takeoff_asked: bool = False
    time: float = 0.0
    release: float = 0.0


class Decision(NamedTuple):
    """The mode, why (a Condition or ON_REQUEST), what is raised, and the request's answer.

    ``answer``: NOT_ASKED, DONE or NOT_DONE; ``blocked_by`` is the condition that forbids the request, or NO_REASON.
    ``guard_request`` is what the vehicle interface asks of the guard.
    """

    mode: Mode
    reason: int
    changed: bool
    raised: Set[Condition]
    answer: int
    blocked_by: int
    guard_request: int


def step(
    parameters: ModeParameters, memory: Memory, health: Health, request: Request, dt: float
) -> tuple[Decision, Memory]:
    """Return the decision of one step of ``dt`` s and the next memory."""
    memory = memory._replace(time=memory.time + dt, release=max(memory.release - dt, 0.0))
    raised = memory.lasting | conditions(parameters, memory, health)
    mode, reason = memory.mode, memory.reason
    for here, achieved, then, _ in PROGRESS:
        if here == mode and achieved in raised:
            mode, reason = then, achieved
            break
    answer, blocked_by = NOT_ASKED, NO_REASON
    if request != Request.NONE:
        answer, blocked_by = asked(mode, request, raised)
        if answer == DONE and (mode != GRANTED[request][mode] or request == Request.GOTO):
            mode, reason = GRANTED[request][mode], ON_REQUEST
    worst = most_severe(mode, raised)
    if worst != NO_REASON:
        mode, reason = TABLE[mode][Condition(worst)], worst
    changed = mode != memory.mode
    in_mission = mode == Mode.MISSION or (mode == Mode.HOLD and memory.in_mission and reason != ON_REQUEST)
    by_reference = Mode.TAKEOFF <= mode <= Mode.LAND
    release = memory.release if by_reference else 0.0
    if memory.mode == Mode.DESCEND and by_reference:
        release = parameters.release_time
    after = Memory(
        mode,
        reason,
        frozenset() if mode == Mode.DISARMED else LASTING & raised,
        in_mission and reason != Condition.PLAN_ENDED,
        mode == Mode.ARMING and (memory.takeoff_asked or (request == Request.TAKEOFF and answer == DONE)),
        0.0 if changed else memory.time,
        release,
    )
    return Decision(mode, reason, changed, raised, answer, blocked_by, guard_request(mode, release)), after


def conditions(parameters: ModeParameters, memory: Memory, health: Health) -> Set[Condition]:
    """Return what is raised now."""
    limits, mode, report = parameters, memory.mode, health.guard
    waits = mode == Mode.MISSION or memory.in_mission
    # once it descends on request the guard's mode says nothing new: what is wrong now does
    wrong = report.condition not in (guard.GOOD, guard.REQUESTED)
    unseen = mode != Mode.DESCEND and memory.release <= 0.0
    found = {
        Condition.REFERENCE_LATE: waits and health.reference_age > limits.reference_late,
        Condition.REFERENCE_LOST: waits and health.reference_age > limits.reference_lost,
        Condition.SETPOINT_LOST: health.setpoint_age > limits.setpoint_lost,
        Condition.STATE_LOST: health.state_age > limits.state_lost,
        Condition.STATE_REFUSED: report.land,
        Condition.POSITION_LOST: not health.position_good,
        Condition.POSITION_ERROR: health.position_error > limits.position_error,
        Condition.LARGE_POSITION_ERROR: health.position_error > limits.large_position_error,
        Condition.FENCE: health.outside_fence,
        Condition.BATTERY_LOW: health.battery < limits.battery_low,
        Condition.ESTIMATOR_RESET: health.estimator_reset,
        Condition.OVERRUNS: health.overruns > limits.overruns,
        Condition.RECORDER_LOST: health.recorder_lost and limits.land_without_recorder,
        Condition.GUARD_DESCENDS: report.mode == guard.DESCEND and (wrong or unseen),
        Condition.GUARD_KILLED: report.mode == guard.KILL,
        Condition.PILOT_TOOK_OVER: health.pilot,
        Condition.END_ASKED: health.end_asked,
        Condition.TAKEOFF_LATE: mode == Mode.TAKEOFF and memory.time > limits.takeoff_late,
        Condition.LANDING_LATE: mode == Mode.LAND and health.done_time > limits.landing_late,
        Condition.ARMING_LATE: mode == Mode.ARMING and memory.time > limits.arming_late,
        Condition.READY: memory.takeoff_asked and health.checks_passed and memory.time >= limits.spool_up,
        Condition.AT_HEIGHT: mode == Mode.TAKEOFF and health.reference_done,
        Condition.PLAN_ENDED: health.plan_ended,
        Condition.CONTACT: report.contact or report.stopped or health.landed,
    }
    return frozenset(condition for condition, is_raised in found.items() if is_raised)


def asked(mode: Mode, request: Request, raised: Set[Condition]) -> tuple[int, int]:
    """Return DONE or NOT_DONE, and the condition that forbids ``request``."""
    target = GRANTED[request].get(mode)
    if target is None or (mode == Mode.PILOT and request == Request.DISARM and Condition.CONTACT not in raised):
        return NOT_DONE, NO_REASON
    if (target < mode or target == Mode.ARMING) and target != Mode.DISARMED:
        blocking = most_severe(target, raised)
        if blocking != NO_REASON:
            return NOT_DONE, blocking
    return DONE, NO_REASON


def most_severe(mode: Mode, raised: Set[Condition]) -> int:
    """Return the raised fault that leads from ``mode`` to the most severe other mode, or NO_REASON."""
    leading = [row.condition for row in FAULTS if row.condition in raised and TABLE[mode][row.condition] != mode]
    return max(leading, key=TABLE[mode].__getitem__, default=NO_REASON)


def guard_request(mode: Mode, release: float) -> int:
    """Return what is asked of the guard in ``mode``; it gives back only after a request, within ``release`` s."""
    if mode == Mode.KILL:
        return guard.ASK_KILL
    if mode == Mode.DESCEND:
        return guard.ASK_DESCEND
    return guard.RELEASE if release > 0.0 else guard.NO_REQUEST


def words(name: str) -> str:
    """Return an enum's name as people write it."""
    return name.lower().replace("_", " ")


def shown_limits(parameters: ModeParameters) -> dict[str, str]:
    """Return the parameters as people read them: degrees, per cent, or with their unit."""
    shown = {}
    for field in fields(parameters):
        value, unit = field.default, getattr(field.spec, "unit", "")
        if unit == "rad":
            shown[field.name] = f"{math.degrees(float(value)):.0f} deg"
        else:
            shown[field.name] = f"{value:g} {unit}" if unit else f"{100.0 * float(value):.0f} %"
    return shown


def reason_text(
    parameters: ModeParameters, mode: Mode, reason: int, sender: str, guard_reason: int = guard.GOOD
) -> str:
    """Return why ``mode`` was entered, who is silent first; ``sender`` made the last request.

    ``guard_reason``: why the guard acted, of ``quad_guard.guard.REASONS``.
    """
    if reason == NO_REASON:
        return ""
    if reason == ON_REQUEST:
        return f"asked for by {sender}"
    rows = {row.condition: f"{row.publisher} is silent: {row.text}" if row.publisher else row.text for row in FAULTS}
    rows |= {condition: text for _, condition, then, text in reversed(PROGRESS) if then == mode}
    text = rows.get(Condition(reason)) or words(Condition(reason).name)
    if reason in (Condition.GUARD_DESCENDS, Condition.GUARD_KILLED) and guard_reason != guard.GOOD:
        silent = f" from {ATTITUDE}" if guard_reason == guard.WRENCH_LOST else ""
        text += f": {guard.REASONS[guard_reason]}{silent}"
    return text.format(**shown_limits(parameters))


def refusal_text(mode: Mode, request: Request, blocked_by: int) -> str:
    """Return why ``request`` was refused in ``mode``."""
    if blocked_by == NO_REASON:
        return f"{request.name} is not possible in {mode.name}"
    return f"{request.name} is not possible: {words(Condition(blocked_by).name)}"
