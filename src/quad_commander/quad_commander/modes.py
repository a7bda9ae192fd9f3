"""Which mode the vehicle is in: one pure step over the mode table.

``CommanderCore`` calls ``step`` at each of its steps (100 Hz), which needs nothing else to decide:

    decision, memory = modes.step(parameters, memory, seen, request, dt)
    # decision.mode goes to ModeReference, decision.guard_request to the vehicle interface

Per step: first what is achieved moves on, then the request is answered, then the most severe of what is wrong wins.
A mode is left for a less severe one only by request, and a request into a mode that a raised condition would leave at
once is refused, naming the condition. KILL is final; PILOT ends on the ground only, by DISARM, and asks for nothing.
A take-off that is to hold before the vehicle is clear of the ground lands instead: what holds there slides.
"""

from collections.abc import Set
from typing import NamedTuple

from quad_commander.mode_table import BY_REFERENCE, FAULTS, GRANTED, LASTING, PROGRESS, TABLE, Condition, severity
from quad_commander.parameters import ModeParameters
from quad_core.cascade import ATTITUDE
from quad_core.enumerations import ON_GROUND, Answer, GuardMode, GuardReason, GuardRequest, Mode, Request
from quad_core.types import GuardStatus, TrajectoryPoint, VehicleState
from quad_guard import guard

NO_REASON, ON_REQUEST = -1, -2  # reasons that are no condition: none yet, and on request


class Inputs(NamedTuple):
    """What is observed at one step; the defaults are a healthy vehicle in the air.

    The node fills in what stands before ``reference_age``, ``CommanderCore`` the rest. Ages in s (steps times period in
    lockstep, steady clock in real time). ``mission``: newest point of the mission's trajectory, whose step is
    ``mission_lag`` s before this one; None before the first. ``guard``: its last report.
    ``battery``: share of full, 1 if unknown. ``refusals``: reasons against arming if they were looked for.
    ``estimator_reset``: the estimate jumped since the last step. ``end_asked``: why the flight shall end, empty if it
    shall not. ``by_autopilot``: an autopilot owns the vehicle; ``autopilot_flies``: it flies it now; ``pilot``,
    ``landed`` and ``position_good`` are what it says.

    ``reference_age`` is that of the mission's. ``position_error``: distance from the reference in m.
    ``reference_done``: the reference of this mode has come to rest at its end, ``done_time`` s ago.
    """

    step: int = 0
    dt: float = 0.0
    state: VehicleState = VehicleState()
    mission: TrajectoryPoint | None = None
    mission_lag: float = 0.0
    setpoint_age: float = 0.0
    state_age: float = 0.0
    overruns: float = 0.0
    guard: GuardStatus = GuardStatus()
    battery: float = 1.0
    refusals: list[str] | None = None
    recorder_lost: bool = False
    estimator_reset: bool = False
    end_asked: str = ""
    by_autopilot: bool = False
    autopilot_flies: bool = False
    pilot: bool = False
    landed: bool = False
    position_good: bool = True
    reference_age: float = 0.0
    position_error: float = 0.0
    outside_fence: bool = False
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

    ``blocked_by`` is the condition that forbids the request, or NO_REASON.
    ``guard_request`` is what the vehicle interface asks of the guard.
    """

    mode: Mode
    reason: int
    changed: bool
    raised: Set[Condition]
    answer: int
    blocked_by: int
    guard_request: int


def step(limits: ModeParameters, memory: Memory, seen: Inputs, request: Request, dt: float) -> tuple[Decision, Memory]:
    """Return the decision of one step of ``dt`` s and the next memory."""
    memory = memory._replace(time=memory.time + dt, release=max(memory.release - dt, 0.0))
    raised = memory.lasting | conditions(limits, memory, seen)
    mode, reason = memory.mode, memory.reason
    for here, achieved, then, _ in PROGRESS:
        if here == mode and achieved in raised:
            mode, reason = then, achieved
            break
    answer, blocked_by = Answer.NOT_ASKED, NO_REASON
    if request != Request.NONE:
        answer, blocked_by = asked(mode, request, raised, seen.state.on_ground)
        # a HOLD that a fault began becomes the one asked for: no mission is waited for
        if answer == Answer.DONE and (mode != GRANTED[request][mode] or mode == Mode.HOLD):
            mode, reason = GRANTED[request][mode], ON_REQUEST
    worst = most_severe(mode, raised)
    if worst != NO_REASON:
        mode, reason = TABLE[mode][Condition(worst)], worst
    holds_in_place = reason != Condition.AT_HEIGHT and (reason != ON_REQUEST or request != Request.GOTO)
    if memory.mode in (*ON_GROUND, Mode.TAKEOFF) and mode == Mode.HOLD and holds_in_place and seen.state.on_ground:
        mode = Mode.LAND
    changed = mode != memory.mode
    in_mission = mode == Mode.MISSION or (mode == Mode.HOLD and memory.in_mission and reason != ON_REQUEST)
    by_reference = mode in BY_REFERENCE
    release = memory.release if by_reference else 0.0
    if memory.mode == Mode.DESCEND and by_reference:
        release = limits.release_time
    after = Memory(
        mode,
        reason,
        frozenset() if mode == Mode.DISARMED else LASTING & raised,
        in_mission and reason != Condition.PLAN_ENDED,
        mode == Mode.ARMING and (memory.takeoff_asked or (request == Request.TAKEOFF and answer == Answer.DONE)),
        0.0 if changed else memory.time,
        release,
    )
    return Decision(mode, reason, changed, raised, answer, blocked_by, guard_request(mode, release)), after


def conditions(limits: ModeParameters, memory: Memory, seen: Inputs) -> Set[Condition]:
    """Return what is raised now."""
    mode, report = memory.mode, seen.guard
    waits = mode == Mode.MISSION or memory.in_mission
    # once it descends on request the guard's mode says nothing new: what is wrong now does
    has_own_cause = report.condition not in (GuardReason.GOOD, GuardReason.REQUESTED)
    acts_unasked = mode != Mode.DESCEND and memory.release <= 0.0
    # what the guard stops in the simulator an autopilot lands: it has states and laws of its own
    lands = report.mode == GuardMode.DESCEND or (report.mode == GuardMode.KILL and seen.by_autopilot)
    found = {
        Condition.REFERENCE_LATE: waits and seen.reference_age > limits.reference_late,
        Condition.REFERENCE_LOST: waits and seen.reference_age > limits.reference_lost,
        Condition.SETPOINT_LOST: seen.setpoint_age > limits.setpoint_lost,
        Condition.STATE_LOST: seen.state_age > limits.state_lost,
        Condition.STATE_REFUSED: report.land,
        Condition.POSITION_LOST: not seen.position_good,
        Condition.POSITION_ERROR: seen.position_error > limits.position_error,
        Condition.LARGE_POSITION_ERROR: seen.position_error > limits.large_position_error,
        Condition.FENCE: seen.outside_fence,
        Condition.BATTERY_LOW: seen.battery < limits.battery_low,
        Condition.ESTIMATOR_RESET: seen.estimator_reset,
        Condition.OVERRUNS: seen.overruns > limits.overruns,
        Condition.RECORDER_LOST: seen.recorder_lost and limits.land_without_recorder,
        Condition.GUARD_DESCENDS: lands and (has_own_cause or acts_unasked),
        Condition.GUARD_KILLED: report.mode == GuardMode.KILL and not seen.by_autopilot,
        Condition.PILOT_TOOK_OVER: seen.pilot,
        Condition.END_ASKED: bool(seen.end_asked),
        Condition.TAKEOFF_LATE: mode == Mode.TAKEOFF and memory.time > limits.takeoff_late,
        Condition.LANDING_LATE: mode == Mode.LAND and seen.done_time > limits.landing_late,
        Condition.ARMING_LATE: mode == Mode.ARMING and memory.time > limits.arming_late,
        Condition.READY: memory.takeoff_asked and seen.checks_passed and memory.time >= limits.spool_up,
        Condition.AT_HEIGHT: mode == Mode.TAKEOFF and seen.reference_done,
        Condition.PLAN_ENDED: seen.plan_ended,
        Condition.CONTACT: report.contact or report.stopped or seen.landed,
    }
    return frozenset(condition for condition, is_raised in found.items() if is_raised)


def asked(mode: Mode, request: Request, raised: Set[Condition], on_ground: bool) -> tuple[Answer, int]:
    """Return the answer, and the condition that forbids ``request``; ``on_ground``: not clear of the ground."""
    target = GRANTED[request].get(mode)
    slides = mode == Mode.LAND and request == Request.HOLD and on_ground
    flies = mode == Mode.PILOT and request == Request.DISARM and Condition.CONTACT not in raised
    if target is None or slides or flies:
        return Answer.REFUSED, NO_REASON
    if (severity(target) < severity(mode) or target == Mode.ARMING) and target != Mode.DISARMED:
        blocking = most_severe(target, raised)
        if blocking != NO_REASON:
            return Answer.REFUSED, blocking
    return Answer.DONE, NO_REASON


def most_severe(mode: Mode, raised: Set[Condition]) -> int:
    """Return the raised fault that leads from ``mode`` to the most severe other mode, or NO_REASON."""
    leading = [row.condition for row in FAULTS if row.condition in raised and TABLE[mode][row.condition] != mode]
    return max(leading, key=lambda condition: severity(TABLE[mode][condition]), default=NO_REASON)


def guard_request(mode: Mode, release: float) -> int:
    """Return what is asked of the guard in ``mode``; it gives back only after a request, within ``release`` s."""
    if mode == Mode.KILL:
        return GuardRequest.KILL
    if mode == Mode.DESCEND:
        return GuardRequest.DESCEND
    return GuardRequest.RELEASE if release > 0.0 else GuardRequest.NONE


def words(name: str) -> str:
    """Return an enum's name as people write it."""
    return name.lower().replace("_", " ")


def reason_text(
    parameters: ModeParameters, mode: Mode, reason: int, sender: str, guard_reason: int = GuardReason.GOOD
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
    if reason in (Condition.GUARD_DESCENDS, Condition.GUARD_KILLED) and guard_reason != GuardReason.GOOD:
        silent = f" from {ATTITUDE}" if guard_reason == GuardReason.WRENCH_LOST else ""
        text += f": {guard.REASONS[guard_reason]}{silent}"
    return text.format(**parameters._asdict())


def refusal_text(mode: Mode, request: Request, blocked_by: int) -> str:
    """Return why ``request`` was refused in ``mode``."""
    if blocked_by == NO_REASON:
        return f"{request.name} is not possible in {mode.name}"
    return f"{request.name} is not possible: {words(Condition(blocked_by).name)}"
