"""From the ground to the flight and back, with the autopilot's own reasons where it refuses.

::

    STREAM -> PROBE -> STREAM -> STANDBY -> MODE -> ARM -> SPOOL_UP -> FLY -> LAND -> LANDED
                any of them -> RELEASED: quiet for good, nothing is asked of the autopilot again

The commander's mode (``Inputs.wish``) leads from STANDBY on. An own take-off of the autopilot is
FLY -> CLIMB -> RETURN -> FLY, a landing of ours ends with FLY -> DISARM -> LANDED, and a flight that the commander
ends on the ground with STANDBY -> LANDED.

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

from quad_autopilot.autopilot import (
    COMMANDS,
    FORCE,
    IN_PROGRESS,
    RESULTS,
    Ack,
    Autopilot,
    Control,
    Profile,
    Request,
    because,
)
from quad_autopilot.parameters import ArmingParameters

NAMED_WITHIN = 0.5
"""Seconds in which an autopilot says in which mode it is now (PX4: 0.2)."""
PROBES = 3
"""Probes of an autopilot that notices too late: a busy machine delays the last heartbeat, never the other way round."""
PROBE_PATIENCE = 3.0
"""Seconds of PROBE after which the autopilot counts as one that does not notice a lost stream."""
DISARMED_WITHIN = 3.0
"""Seconds for disarming on the ground after a landing of ours."""
SILENT_FOR = 5.0
"""Seconds without any message after which the landing of an autopilot is not waited for."""


class Phase(IntEnum):
    """Where the vehicle is between ground and ground."""

    STREAM = 0
    MODE = 1
    ARM = 2
    SPOOL_UP = 3
    FLY = 4
    LAND = 5
    LANDED = 6
    RELEASED = 7
    PROBE = 8
    STANDBY = 9
    CLIMB = 10
    RETURN = 11
    DISARM = 12


STREAM, MODE, ARM, SPOOL_UP, FLY, LAND, LANDED, RELEASED, PROBE, STANDBY, CLIMB, RETURN, DISARM = Phase


class Wish(IntEnum):
    """What the flight wants of the autopilot now."""

    GROUND = 0
    """Stay disarmed, or disarm on the ground."""
    IDLE = 1
    """Armed, rotors at idle."""
    FLY = 2
    CLIMB = 3
    """Take off by itself, then fly by us."""
    LAND = 4
    """Land by itself."""
    KILL = 5


_WAITS, _LANDS = (Control.WAITING, Control.UNSAID), (Control.OURS, Control.LANDING, Control.UNSAID)
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


class Inputs(NamedTuple):
    """What is known now. Times and ages in s; an age is infinite before the first message.

    ``now`` is the steady clock, ``autopilot_time`` the autopilot's own. ``command_age``: for how long a state
    has waited for a command. ``refusal``: why the flight must not begin, empty if it may; while the commander is
    arming, what it still waits for. ``stop``: why it must end now, empty if it need not. ``silence``: time since the
    autopilot sent anything. ``is_over``: the commander has ended the flight. ``moves``: the estimate does not rest yet.
    """

    now: float
    autopilot_time: float
    autopilot: Autopilot | None
    ack: Ack | None = None
    command_age: float = math.inf
    state_age: float = math.inf
    refusal: str = ""
    stop: str = ""
    silence: float = 0.0
    wish: Wish = Wish.FLY
    is_over: bool = False
    moves: bool = False


class Memory(NamedTuple):
    """``since``: steady s at which the phase began; ``answer``: the last that the autopilot said to its request.

    ``left_at``: steady s at which the mode was ours no more, infinite before. ``noticed``: least time in s in which the
    autopilot noticed that the stream had stopped, NaN before PROBE. ``usual``: what it said against a flight at its
    begin. ``distrusted``: the flight failed in the air and LAND follows no command any more; a vehicle that stands on
    the ground and is not disarmed still takes the commands of its disarmed link.
    """

    phase: Phase = Phase.STREAM
    since: float = -1.0
    beats: int = 0
    asked_at: float = -math.inf
    attempts: int = 0
    answer: str = ""
    spooled_from: float = 0.0
    left_at: float = math.inf
    reason: str = ""
    distrusted: bool = False
    noticed: float = math.nan
    probes: int = 0
    usual: tuple[str, ...] = ()


class Output(NamedTuple):
    """What to send now. ``reason`` is why the flight has failed, empty if it has not."""

    phase: Phase
    heartbeat: bool
    setpoint: Setpoint
    request: Request | None
    reason: str


QUIET = Output(STREAM, False, Setpoint.NONE, None, "")
"""What goes out before the sequence begins."""


class Case:
    """What the conditions of ``RULES`` look at, and the words of their texts."""

    def __init__(self, profile: Profile, limits: ArmingParameters, memory: Memory, inputs: Inputs) -> None:
        """Derive them from what is known."""
        said = inputs.autopilot or Autopilot("no mode yet", Control.OTHER, False)
        self.profile, self.limits, self.memory, self.inputs, self.said = profile, limits, memory, inputs, said
        self.wish, self.armed, self.control = inputs.wish, said.armed, said.control
        self.elapsed = inputs.now - memory.since
        self.late, self.overdue = self.elapsed > limits.step_timeout, self.elapsed > limits.land_timeout
        self.blind = inputs.state_age > limits.state_timeout
        self.left = math.isfinite(memory.left_at)
        self.unnamed = said.control == Control.UNSAID and inputs.now - memory.left_at < NAMED_WITHIN
        self.spooled = inputs.autopilot_time - memory.spooled_from >= limits.spool_up
        self.uncommanded = inputs.command_age > limits.command_timeout
        self.undisarmed = self.elapsed > DISARMED_WITHIN and inputs.wish != Wish.KILL
        self.unaware = bool(profile.loss_limit) and not memory.noticed <= profile.loss_limit
        self.patient = self.elapsed <= PROBE_PATIENCE
        if said.stream_lost and said.lost_at > memory.spooled_from:
            self.loss = said.lost_at - memory.spooled_from
        else:  # one that says nothing of the stream: the event at the start names its parameters
            self.loss = math.inf if self.patient or said.stream_lost is not None else 0.0

    def told(self, text: str) -> str:
        """Return ``text`` with its words."""
        memory, said, request = self.memory, self.said, _asked_in(self.profile, self.memory.phase)
        why, waits_for = because(said, memory.usual), self.inputs.refusal
        by = f"{self.profile.name}'s failsafe" if said.failsafe else f"a pilot or {self.profile.name}"
        return text.format(
            p=self.profile,
            i=self.inputs,
            l=self.limits,
            mode=said.mode,
            why=why,
            taken=f"{by} took the vehicle",
            now=f"mode {said.mode}{why}",
            idle="".join(f"{mark}{part}" for mark, part in ((" ", self.profile.idle_hint), ("; ", waits_for)) if part),
            silent=1e3 * min(self.inputs.command_age, self.elapsed),
            noticed="not" if math.isinf(memory.noticed) else f"after {memory.noticed:.2f} s",
            answer=f"{COMMANDS.get(request.command, '') if request else ''} "
            f"{memory.answer or 'never acknowledged (is target_system right?)'}",
        )


def is_unsettled(case: Case) -> bool:
    """Return whether a trajectory would be planned from a start that moves; flight.start_timeout ends the wait."""
    return case.inputs.moves


def is_called_off(case: Case) -> bool:
    """Return whether the commander has ended a flight that the autopilot was not armed for."""
    return case.inputs.is_over


def is_disarmed_idle(case: Case) -> bool:
    """Return whether an autopilot that stood with idling rotors, waiting for the take-off, has disarmed."""
    return not case.armed and case.wish == Wish.IDLE


def is_unheard(case: Case) -> bool:
    """Return whether nothing comes from the autopilot any more."""
    return case.inputs.silence > SILENT_FOR


_GROUND, _ARMING, _TAKE_OFF = (STREAM, PROBE, STANDBY), (MODE, ARM, SPOOL_UP), (CLIMB, RETURN)
_WITHIN = "within {l.step_timeout:g} s:{answer}{why}"

RULES: tuple[tuple[tuple[Phase, ...], Callable[[Case], object], Phase | None, str], ...] = (
    ((*_ARMING, FLY, *_TAKE_OFF, LAND), lambda c: c.wish == Wish.KILL, DISARM, ""),
    # what the autopilot, or a pilot, does by itself
    ((DISARM, LAND), lambda c: not c.armed, LANDED, ""),
    ((FLY,), is_disarmed_idle, RELEASED, "{p.name} disarmed before the take-off{idle}{why}"),
    ((FLY,), lambda c: not c.armed, RELEASED, "{p.name} disarmed in flight{why}"),
    (_TAKE_OFF, lambda c: not c.armed, RELEASED, "{p.name} disarmed during its take-off{why}"),
    ((ARM, SPOOL_UP, FLY), lambda c: c.left and c.unnamed, None, ""),
    ((ARM, SPOOL_UP), lambda c: c.left, RELEASED, "{taken} before the flight: {now}"),
    ((FLY,), lambda c: c.left, RELEASED, "{taken} in flight: {now}"),
    ((*_ARMING, FLY, *_TAKE_OFF), lambda c: c.inputs.stop and c.armed, LAND, "{i.stop}"),
    ((*_GROUND, *_ARMING), lambda c: c.inputs.stop, RELEASED, "{i.stop}"),
    # on the ground, up to the first request
    ((STREAM,), lambda c: c.inputs.autopilot is None and not c.late, None, ""),
    ((STREAM,), lambda c: c.inputs.autopilot is None, RELEASED, "no {p.status} from {p.name}: {p.hint}"),
    ((STREAM,), lambda c: c.armed, RELEASED, "{p.name} is armed already, in {mode}: disarm it first"),
    (_GROUND, lambda c: c.armed, RELEASED, "{p.name} was armed in {mode} before the flight"),
    ((STREAM,), lambda c: c.blind and c.late, RELEASED, "no {p.state} from {p.name} that can be accepted"),
    ((STREAM,), lambda c: c.blind or c.memory.beats < c.limits.beats, None, ""),
    ((STREAM,), lambda c: c.unaware and c.memory.probes < PROBES, PROBE, ""),
    ((STREAM,), lambda c: c.unaware, RELEASED, _UNAWARE),
    ((STREAM,), lambda c: c.inputs.refusal and c.late, RELEASED, "arming refused: {i.refusal}"),
    ((STREAM,), lambda c: c.inputs.refusal, None, ""),
    ((STREAM,), is_unsettled, None, ""),
    ((STREAM,), lambda _: True, STANDBY, ""),
    ((PROBE,), lambda c: math.isfinite(c.loss) or not c.patient, STREAM, ""),
    ((STANDBY,), is_called_off, LANDED, ""),
    ((STANDBY,), lambda c: Wish.IDLE <= c.wish <= Wish.CLIMB, MODE, ""),
    # to the flight
    (_ARMING, lambda c: c.wish == Wish.GROUND and c.armed, DISARM, ""),
    (_ARMING, lambda c: c.wish == Wish.GROUND, STANDBY, ""),
    ((MODE,), lambda c: c.control == Control.OURS, ARM, ""),
    ((ARM,), lambda c: c.armed, SPOOL_UP, ""),
    ((MODE,), lambda c: c.late and c.profile.mode, RELEASED, "{p.name} did not change to {p.offboard} " + _WITHIN),
    ((ARM,), lambda c: c.late, RELEASED, "{p.name} did not arm " + _WITHIN),
    ((SPOOL_UP,), lambda c: not c.armed, RELEASED, "{p.name} disarmed while the rotors spooled up{why}"),
    ((SPOOL_UP, FLY), lambda c: c.blind, LAND, "{p.state}: nothing for {i.state_age:.2f} s"),
    ((SPOOL_UP,), lambda c: c.spooled, FLY, ""),
    # in flight
    ((FLY,), lambda c: c.uncommanded, LAND, "controllers: no command for {silent:.0f} ms"),
    ((FLY,), lambda c: c.wish == Wish.GROUND, DISARM, ""),
    ((FLY,), lambda c: c.wish == Wish.CLIMB, CLIMB, ""),
    ((FLY,), lambda c: c.wish == Wish.LAND, LAND, ""),
    # a take-off of the autopilot's own, and back to our mode
    (_TAKE_OFF, lambda c: c.wish in (Wish.GROUND, Wish.LAND), LAND, "landing asked for during the take-off"),
    ((CLIMB,), lambda c: c.control == Control.OTHER, RELEASED, "{taken} during its take-off: {now}"),
    ((CLIMB,), lambda c: c.control == Control.WAITING and not c.said.landed, RETURN, ""),
    ((CLIMB,), lambda c: c.overdue, LAND, "{p.name}: no end of its take-off,{answer}"),
    ((RETURN,), lambda c: c.control == Control.OURS, FLY, ""),
    ((RETURN,), lambda c: c.control not in _WAITS, RELEASED, "{taken} after its take-off: {now}"),
    ((RETURN,), lambda c: c.late, LAND, "{p.name} did not change to {p.offboard} after its take-off:{answer}"),
    # to the ground; an autopilot that does not see the ground lands by itself
    ((DISARM,), lambda c: c.undisarmed, LAND, "{p.name} does not disarm:{answer}"),
    ((LAND,), lambda c: c.control not in _LANDS, RELEASED, "{taken} while landing: {now}"),
    ((LAND,), is_unheard, RELEASED, _UNHEARD),
    ((LAND,), lambda c: c.overdue, RELEASED, _NOT_LANDED),
    ((DISARM,), is_unheard, RELEASED, "nothing heard from {p.name} for {i.silence:.0f} s: its motors may still turn"),
    ((DISARM,), lambda c: c.overdue, RELEASED, "{p.name} does not stop its motors:{answer}"),
)
"""While in these phases, what holds leads to that phase (None: stay); the first row counts.

A text makes the flight a failed one; its words are those of ``Case.told``.
"""


def step(profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> tuple[Output, Memory]:
    """Return what to send, and the next memory; ``profile`` says how this autopilot is asked."""
    memory = _noted(profile, memory, inputs)
    case = Case(profile, parameters, memory, inputs)
    if inputs.autopilot is not None or memory.phase == STREAM:
        found = (row for row in RULES if memory.phase in row[0] and row[1](case))
        _, _, phase, text = next(found, ((), None, None, ""))
        if phase is not None:
            memory = _entered(case, phase, text)
            case = Case(profile, parameters, memory, inputs)
    request = _request(case)
    heartbeat, setpoint = _stream(case)
    output = Output(memory.phase, heartbeat, setpoint, request, memory.reason)
    memory = memory._replace(beats=memory.beats + int(heartbeat))
    return output, memory._replace(asked_at=inputs.now, attempts=memory.attempts + 1) if request else memory


def _noted(profile: Profile, memory: Memory, inputs: Inputs) -> Memory:
    """Return the memory with the answer to our request, and with when the mode was taken away."""
    said, request, ack = inputs.autopilot, _asked_in(profile, memory.phase), inputs.ack
    if memory.since < 0.0:
        memory = memory._replace(since=inputs.now)
    if request and ack and ack.command == request.command and ack.result != IN_PROGRESS:
        known = 0 <= ack.result < len(RESULTS)
        memory = memory._replace(answer=RESULTS[ack.result] if known else f"result {ack.result}")
    taken = said and said.control != Control.OURS and (said.armed or memory.phase != FLY)
    if taken and memory.phase in (ARM, SPOOL_UP, FLY) and inputs.wish != Wish.KILL:
        memory = memory._replace(left_at=min(memory.left_at, inputs.now))
    return memory


def _entered(case: Case, phase: Phase, text: str) -> Memory:
    """Return the memory at the beginning of ``phase``; ``text``: why the flight has failed, empty if it has not."""
    before, now = case.memory, case.inputs.now
    memory = before._replace(
        phase=phase, since=now, asked_at=-math.inf, attempts=0, answer="", spooled_from=case.inputs.autopilot_time
    )
    if text:
        lands = f"; {case.profile.name} lands" if phase == LAND else ""
        reason = "; ".join(filter(None, (before.reason, case.told(text) + lands)))
        memory = memory._replace(reason=reason, distrusted=before.phase != DISARM)
    if phase == PROBE:
        return memory._replace(probes=before.probes + 1)
    if before.phase == PROBE and phase == STREAM:
        return memory._replace(beats=0, noticed=min(case.loss, before.noticed))  # NaN, before the first, is not less
    return memory._replace(usual=case.said.reasons) if before.phase == SPOOL_UP and phase == FLY else memory


def _asked_in(profile: Profile, phase: Phase) -> Request | None:
    asked = {MODE: profile.mode, ARM: profile.arm, CLIMB: profile.takeoff, RETURN: profile.mode}
    return {**asked, LAND: profile.land, DISARM: profile.disarm}.get(phase)


def _request(case: Case) -> Request | None:
    """Return the request that is due; one without an effect is repeated."""
    memory = case.memory
    request = _asked_in(case.profile, memory.phase)
    done = {LAND: (Control.LANDING, Control.UNSAID), CLIMB: (Control.CLIMBING, Control.WAITING)}
    if request is None or case.left or case.control in done.get(memory.phase, ()):
        return None
    if case.inputs.now - memory.asked_at < case.limits.answer_timeout:
        return None
    forced = memory.phase == DISARM and case.wish == Wish.KILL
    return request._replace(attempt=memory.attempts, param2=FORCE if forced else request.param2)


def _stream(case: Case) -> tuple[bool, Setpoint]:
    """Return whether a heartbeat goes out, and what setpoint."""
    phase, age = case.memory.phase, case.inputs.command_age
    fresh = age <= case.limits.command_timeout
    if case.left:
        return False, Setpoint.NONE
    if phase in (STREAM, MODE, ARM, SPOOL_UP, STANDBY, CLIMB, DISARM):
        return not (phase == DISARM and case.wish == Wish.KILL), Setpoint.IDLE
    if phase == RETURN:
        return fresh, Setpoint.COMMAND
    if phase not in (FLY, LAND) or case.control != Control.OURS:
        return False, Setpoint.NONE
    if phase == FLY and case.wish in (Wish.GROUND, Wish.IDLE, Wish.CLIMB):
        return True, Setpoint.IDLE
    if case.memory.distrusted or not fresh:
        return False, Setpoint.LEVEL
    return True, Setpoint.COMMAND
