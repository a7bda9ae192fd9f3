"""From the ground to the flight and back, with the autopilot's own reasons where it refuses.

::

    STREAM -> PROBE -> STREAM -> STANDBY -> MODE -> ARM -> SPOOL_UP -> FLY -> LAND -> LANDED
                any of them -> RELEASED: quiet for good, nothing is asked of the autopilot again

The commander's mode (``Inputs.intent``) leads from STANDBY on. An own take-off of the autopilot is
FLY -> CLIMB -> RETURN -> FLY, a landing of ours ends with FLY -> DISARM -> LANDED, and a flight that the commander
ends on the ground with STANDBY -> LANDED. Beyond a limit of its step the vehicle is handed back: FLY -> HAND_BACK ->
RELEASED, and where the autopilot cannot hold its place FLY -> LAND.

``step`` is called every 20 ms and is pure; ``RULES`` is the table of all that ends a phase. An autopilot leaves the
offboard mode by itself a while after the last heartbeat (PX4: COM_OF_LOSS_T, 1.0 s unless set), and follows the last
setpoint until then. As long as heartbeats come it follows stale setpoints: so the heartbeat stops with the controller,
and the autopilot is asked to land at once. An autopilot that stabilises nothing itself must notice a lost stream within
``Profile.loss_limit``: PROBE stops the stream on the ground and measures that time. After the mode was taken away
nothing more goes out, even while the autopilot has not yet said which mode it is in.
"""

import math
from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

from quad_autopilot.autopilot import FORCE, IN_PROGRESS, RESULTS, Control, Profile, Request
from quad_autopilot.evidence import (
    Evidence,
    Inputs,
    Intent,
    Memory,
    Phase,
    asked_in,
    flies,
    flies_other_than,
    wants,
    wants_armed,
)
from quad_autopilot.parameters import ArmingParameters

STREAM, MODE, ARM, SPOOL_UP, FLY, LAND, LANDED, RELEASED, PROBE, STANDBY, CLIMB, RETURN, DISARM, HAND_BACK = Phase
_UNAWARE = (
    "arming refused: {p.name} noticed {noticed} that the stream of setpoints had stopped, expected within "
    "{p.loss_limit:g} s: {p.loss_advice}"
)
_UNHEARD = "nothing heard from {p.name} for {i.silence:.0f} s: it lands by its own failsafe, unseen"
_NOT_LANDED = "not landed after {l.land_timeout:g} s:{answer}; {p.name} is in {mode} and still armed"


class Setpoint(IntEnum):
    """What goes to the autopilot with or without a heartbeat."""

    NONE = 0
    IDLE = 1
    COMMAND = 2
    LEVEL = 3


class Output(NamedTuple):
    """What to send now. ``reason`` is why the flight has failed, empty if it has not."""

    phase: Phase
    heartbeat: bool
    setpoint: Setpoint
    request: Request | None
    reason: str


QUIET = Output(STREAM, False, Setpoint.NONE, None, "")  # what goes out before the sequence begins


_GROUND, _ARMING, _TAKE_OFF = (STREAM, PROBE, STANDBY), (MODE, ARM, SPOOL_UP), (CLIMB, RETURN)
_WITHIN = "within {l.step_timeout:g} s:{answer}{why}"

_LANDS = (Control.OURS, Control.LANDING, Control.UNSAID)
E = Evidence
RULES: tuple[tuple[tuple[Phase, ...], Callable[[Evidence], bool], Phase | None, str], ...] = (
    ((*_ARMING, FLY, *_TAKE_OFF, LAND), wants(Intent.KILL), DISARM, ""),
    # what the autopilot, or a pilot, does by itself
    ((DISARM, LAND), E.is_disarmed, LANDED, ""),
    ((FLY,), E.is_disarmed_idle, RELEASED, "{p.name} disarmed before the take-off{idle}{why}"),
    ((FLY,), E.is_disarmed, RELEASED, "{p.name} disarmed in flight{why}"),
    (_TAKE_OFF, E.is_disarmed, RELEASED, "{p.name} disarmed during its take-off{why}"),
    ((ARM, SPOOL_UP, FLY), E.is_taken_by_unnamed, None, ""),
    ((ARM, SPOOL_UP), E.is_taken, RELEASED, "{taken} before the flight: {now}"),
    ((FLY,), E.is_taken, RELEASED, "{taken} in flight: {now}"),
    ((FLY, RETURN), E.has_to_hold, HAND_BACK, "{i.broken_limit}; {p.name} was asked to hold its place"),
    ((FLY, RETURN), E.is_limit_broken, LAND, "{i.broken_limit}"),
    ((HAND_BACK,), E.is_disarmed, RELEASED, ""),
    ((HAND_BACK,), flies_other_than(Control.OURS, Control.UNSAID), RELEASED, ""),
    ((HAND_BACK,), E.does_not_hold, LAND, "{p.name} does not hold its place:{answer}"),
    ((*_ARMING, FLY, *_TAKE_OFF), E.has_to_land, LAND, "{i.stop}"),
    ((*_GROUND, *_ARMING), E.has_to_end, RELEASED, "{i.stop}"),
    # on the ground, up to the first request
    ((STREAM,), E.is_awaited, None, ""),
    ((STREAM,), E.is_absent, RELEASED, "no {p.status} from {p.name}: {p.hint}"),
    ((STREAM,), E.is_armed, RELEASED, "{p.name} is armed already, in {mode}: disarm it first"),
    (_GROUND, E.is_armed, RELEASED, "{p.name} was armed in {mode} before the flight"),
    ((STREAM,), E.stays_blind, RELEASED, "no {p.state} from {p.name} that can be accepted"),
    ((STREAM,), E.is_not_streamed, None, ""),
    ((STREAM,), E.is_probed_next, PROBE, ""),
    ((STREAM,), E.is_unaware, RELEASED, _UNAWARE),
    ((STREAM,), E.stays_refused, RELEASED, "arming refused: {i.refusal}"),
    ((STREAM,), E.is_refused, None, ""),
    ((STREAM,), E.is_settled, STANDBY, ""),
    ((PROBE,), E.has_noticed, STREAM, ""),
    ((STANDBY,), E.is_called_off, LANDED, ""),
    ((STANDBY,), wants(Intent.IDLE, Intent.FLY, Intent.CLIMB), MODE, ""),
    # to the flight
    (_ARMING, wants_armed(Intent.GROUND), DISARM, ""),
    (_ARMING, wants(Intent.GROUND), STANDBY, ""),
    ((MODE,), flies(Control.OURS), ARM, ""),
    ((ARM,), E.is_armed, SPOOL_UP, ""),
    ((MODE,), E.is_not_given, RELEASED, "{p.name} did not change to {p.offboard} " + _WITHIN),
    ((ARM,), E.is_late, RELEASED, "{p.name} did not arm " + _WITHIN),
    ((SPOOL_UP,), E.is_disarmed, RELEASED, "{p.name} disarmed while the rotors spooled up{why}"),
    ((SPOOL_UP, FLY), E.is_blind, LAND, "{p.state}: nothing for {i.state_age:.2f} s"),
    ((SPOOL_UP,), E.is_spooled_up, FLY, ""),
    # in flight
    ((FLY,), E.is_uncommanded, LAND, "controllers: no command for {silent:.0f} ms"),
    ((FLY,), wants(Intent.GROUND), DISARM, ""),
    ((FLY,), wants(Intent.CLIMB), CLIMB, ""),
    ((FLY,), wants(Intent.LAND), LAND, ""),
    # a take-off of the autopilot's own, and back to our mode
    (_TAKE_OFF, wants(Intent.GROUND, Intent.LAND), LAND, "landing asked for during the take-off"),
    ((CLIMB,), flies(Control.OTHER), RELEASED, "{taken} during its take-off: {now}"),
    ((CLIMB,), E.has_climbed, RETURN, ""),
    ((CLIMB,), E.is_overdue, LAND, "{p.name}: no end of its take-off,{answer}"),
    ((RETURN,), flies(Control.OURS), FLY, ""),
    ((RETURN,), flies_other_than(Control.WAITING, Control.UNSAID), RELEASED, "{taken} after its take-off: {now}"),
    ((RETURN,), E.is_late, LAND, "{p.name} did not change to {p.offboard} after its take-off:{answer}"),
    # to the ground; an autopilot that does not see the ground lands by itself
    ((DISARM,), E.does_not_disarm, LAND, "{p.name} does not disarm:{answer}"),
    ((LAND,), flies_other_than(*_LANDS), RELEASED, "{taken} while landing: {now}"),
    ((LAND,), E.is_unheard, RELEASED, _UNHEARD),
    ((LAND,), E.is_overdue, RELEASED, _NOT_LANDED),
    ((DISARM,), E.is_unheard, RELEASED, "nothing heard from {p.name} for {i.silence:.0f} s: its motors may still turn"),
    ((DISARM,), E.is_overdue, RELEASED, "{p.name} does not stop its motors:{answer}"),
)
"""While in these phases, what holds leads to that phase (None: stay); the first row counts.

A text makes the flight a failed one; its words are those of ``Evidence.told``.
"""


def step(profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> tuple[Output, Memory]:
    """Return what to send, and the next memory; ``profile`` says how this autopilot is asked."""
    memory = _noted(profile, memory, inputs)
    case = Evidence(profile, parameters, memory, inputs)
    if inputs.autopilot is not None or memory.phase == STREAM:
        found = (row for row in RULES if memory.phase in row[0] and row[1](case))
        _, _, phase, text = next(found, ((), None, None, ""))
        if phase is not None:
            memory = _entered(case, phase, text)
            case = Evidence(profile, parameters, memory, inputs)
    request = _request(case)
    heartbeat, setpoint = _stream(case)
    output = Output(memory.phase, heartbeat, setpoint, request, memory.reason)
    memory = memory._replace(beats=memory.beats + int(heartbeat))
    return output, memory._replace(asked_at=inputs.now, attempts=memory.attempts + 1) if request else memory


def _noted(profile: Profile, memory: Memory, inputs: Inputs) -> Memory:
    """Return the memory with the answer to our request, and with when the mode was taken away."""
    said, request, ack = inputs.autopilot, asked_in(profile, memory.phase), inputs.ack
    if memory.since < 0.0:
        memory = memory._replace(since=inputs.now)
    if request and ack and ack.command == request.command and ack.result != IN_PROGRESS:
        known = 0 <= ack.result < len(RESULTS)
        memory = memory._replace(answer=RESULTS[ack.result] if known else f"result {ack.result}")
    taken = said and said.control != Control.OURS and (said.armed or memory.phase != FLY)
    if taken and memory.phase in (ARM, SPOOL_UP, FLY) and inputs.intent != Intent.KILL:
        memory = memory._replace(left_at=min(memory.left_at, inputs.now))
    return memory


def _entered(case: Evidence, phase: Phase, text: str) -> Memory:
    """Return the memory at the beginning of ``phase``; ``text``: why the flight has failed, empty if it has not."""
    before, now = case.memory, case.inputs.now
    memory = before._replace(
        phase=phase, since=now, asked_at=-math.inf, attempts=0, answer="", entered_at=case.inputs.autopilot_time
    )
    if text:
        lands = f"; {case.profile.name} lands" if phase == LAND else ""
        reason = "; ".join(filter(None, (before.reason, case.told(text) + lands)))
        memory = memory._replace(reason=reason, distrusted=before.phase != DISARM)
    if phase == PROBE:
        return memory._replace(probes=before.probes + 1)
    if before.phase == PROBE and phase == STREAM:
        return memory._replace(beats=0, noticed=min(case.loss(), before.noticed))  # NaN, before the first, is not less
    return memory._replace(usual=case.said.reasons) if before.phase == SPOOL_UP and phase == FLY else memory


def _request(case: Evidence) -> Request | None:
    """Return the request that is due; one without an effect is repeated."""
    memory = case.memory
    request = asked_in(case.profile, memory.phase)
    done = {LAND: (Control.LANDING, Control.UNSAID), CLIMB: (Control.CLIMBING, Control.WAITING)}
    if request is None or case.is_taken() or case.control in done.get(memory.phase, ()):
        return None
    if case.inputs.now - memory.asked_at < case.limits.answer_timeout:
        return None
    forced = memory.phase == DISARM and case.intent == Intent.KILL
    return request._replace(attempt=memory.attempts, param2=FORCE if forced else request.param2)


def _stream(case: Evidence) -> tuple[bool, Setpoint]:
    """Return whether a heartbeat goes out, and what setpoint."""
    phase, age = case.memory.phase, case.inputs.command_age
    fresh = age <= case.limits.command_timeout
    if case.is_taken():
        return False, Setpoint.NONE
    if phase in (STREAM, MODE, ARM, SPOOL_UP, STANDBY, CLIMB, DISARM):
        return not (phase == DISARM and case.intent == Intent.KILL), Setpoint.IDLE
    if phase == RETURN:
        return fresh, Setpoint.COMMAND
    if phase not in (FLY, LAND) or case.control != Control.OURS:
        return False, Setpoint.NONE
    if phase == FLY and case.intent in (Intent.GROUND, Intent.IDLE, Intent.CLIMB):
        return True, Setpoint.IDLE
    if case.memory.distrusted or not fresh:
        return False, Setpoint.LEVEL
    return True, Setpoint.COMMAND
