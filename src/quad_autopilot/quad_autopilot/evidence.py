"""What is known of an autopilot between ground and ground, and the questions that lead from one phase to the next."""

import math
from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

from quad_autopilot.autopilot import COMMANDS, Ack, Autopilot, Control, Profile, Request, because
from quad_autopilot.parameters import ArmingParameters

NAMED_WITHIN = 0.5  # seconds in which an autopilot says in which mode it is now (PX4: 0.2)
PROBES = 3
"""Probes of an autopilot that notices too late: a busy machine delays the last heartbeat, never the other way round."""
PROBE_PATIENCE = 3.0  # seconds of PROBE after which the autopilot counts as one that does not notice a lost stream
DISARMED_WITHIN = 3.0  # seconds for disarming on the ground after a landing of ours
HELD_WITHIN = 1.0  # seconds for an autopilot to hold its place when it gets the vehicle back
SILENT_FOR = 5.0  # seconds without any message after which the landing of an autopilot is not waited for


class Phase(IntEnum):
    """Where the vehicle is between ground and ground, and what it waits for there."""

    STREAM = 0  # setpoints go out: for the autopilot's status, its states, and whatever keeps the flight from beginning
    MODE = 1  # for our mode
    ARM = 2  # for the autopilot to be armed
    SPOOL_UP = 3  # for the rotors to turn
    FLY = 4  # the controllers fly: for what the commander wants next
    LAND = 5  # the autopilot lands: for it to disarm
    LANDED = 6  # for nothing: the flight is over, and the vehicle disarmed
    RELEASED = 7  # for nothing: the flight is over, and the vehicle another's
    PROBE = 8  # no setpoints go out: for the autopilot to notice that
    STANDBY = 9  # all is ready: for the commander to arm
    CLIMB = 10  # the autopilot takes off: for it to hold its place
    RETURN = 11  # for our mode after the autopilot's take-off
    DISARM = 12  # on the ground: for the autopilot to disarm
    HAND_BACK = 13  # beyond a limit of the step nothing is sent: for the autopilot to hold its place


class Intent(IntEnum):
    """What the flight wants of the autopilot now."""

    GROUND = 0  # stay disarmed, or disarm on the ground
    IDLE = 1  # armed, rotors at idle
    FLY = 2
    CLIMB = 3  # take off by itself, then fly by us
    LAND = 4  # land by itself
    KILL = 5


class Inputs(NamedTuple):
    """What is known now. Times and ages in s; an age is infinite before the first message.

    ``now`` is the steady clock, ``autopilot_time`` the autopilot's own. ``command_age``: for how long a state
    has waited for a command. ``refusal``: why the flight must not begin, empty if it may; while the commander is
    arming, what it still waits for. ``stop``: why it must end now, empty if it need not. ``silence``: time since the
    autopilot sent anything. ``broken_limit``: which limit of the step is broken, empty if none. ``is_over``: the
    commander has ended the flight. ``moves``: the estimate does not rest yet.
    """

    now: float
    autopilot_time: float
    autopilot: Autopilot | None
    ack: Ack | None = None
    command_age: float = math.inf
    state_age: float = math.inf
    refusal: str = ""
    stop: str = ""
    broken_limit: str = ""
    silence: float = 0.0
    intent: Intent = Intent.FLY
    is_over: bool = False
    moves: bool = False


class Memory(NamedTuple):
    """``since``: steady s at which the phase began, ``entered_at``: the same in s of the autopilot's time.

    ``answer``: the last that the autopilot said to its request. ``left_at``: steady s at which the mode was ours no
    more, infinite before. ``noticed``: least time in s in which the autopilot noticed that the stream had stopped, NaN
    before PROBE. ``usual``: what it said against a flight at its begin. ``distrusted``: the flight failed in the air
    and LAND follows no command any more; a vehicle that stands on the ground and is not disarmed still takes the
    commands of its disarmed link.
    """

    phase: Phase = Phase.STREAM
    since: float = -1.0
    beats: int = 0
    asked_at: float = -math.inf
    attempts: int = 0
    answer: str = ""
    entered_at: float = 0.0
    left_at: float = math.inf
    reason: str = ""
    distrusted: bool = False
    noticed: float = math.nan
    probes: int = 0
    usual: tuple[str, ...] = ()


def asked_in(profile: Profile, phase: Phase) -> Request | None:
    """Return what an autopilot is asked for in a phase, None if nothing."""
    return {
        Phase.MODE: profile.mode,
        Phase.ARM: profile.arm,
        Phase.CLIMB: profile.takeoff,
        Phase.RETURN: profile.mode,
        Phase.LAND: profile.land,
        Phase.DISARM: profile.disarm,
        Phase.HAND_BACK: profile.hold,
    }.get(phase)


class Evidence:
    """What is known in a phase: each question is a condition of ``RULES``."""

    def __init__(self, profile: Profile, limits: ArmingParameters, memory: Memory, inputs: Inputs) -> None:
        self.profile, self.limits, self.memory, self.inputs = profile, limits, memory, inputs
        self.said = inputs.autopilot or Autopilot("no mode yet", Control.OTHER, False)
        self.intent, self.control, self.elapsed = inputs.intent, self.said.control, inputs.now - memory.since

    def is_armed(self) -> bool:
        """The autopilot says that its motors may turn."""
        return self.said.armed

    def is_disarmed(self) -> bool:
        """The autopilot says that its motors stand."""
        return not self.said.armed

    def is_disarmed_idle(self) -> bool:
        """An autopilot that stood with idling rotors, waiting for the take-off, has disarmed."""
        return not self.said.armed and self.intent == Intent.IDLE

    def is_late(self) -> bool:
        """The phase takes longer than a step may."""
        return self.elapsed > self.limits.step_timeout

    def is_overdue(self) -> bool:
        """The phase takes longer than a landing may."""
        return self.elapsed > self.limits.land_timeout

    def is_awaited(self) -> bool:
        """The autopilot has said nothing yet, and still may."""
        return self.inputs.autopilot is None and not self.is_late()

    def is_absent(self) -> bool:
        """The autopilot has said nothing yet."""
        return self.inputs.autopilot is None

    def is_unheard(self) -> bool:
        """Nothing comes from the autopilot any more."""
        return self.inputs.silence > SILENT_FOR

    def is_blind(self) -> bool:
        """No state comes."""
        return self.inputs.state_age > self.limits.state_timeout

    def stays_blind(self) -> bool:
        """No state has come for the whole phase."""
        return self.is_blind() and self.is_late()

    def is_not_streamed(self) -> bool:
        """No state comes, or too few setpoints have gone out."""
        return self.is_blind() or self.memory.beats < self.limits.beats

    def is_unaware(self) -> bool:
        """The autopilot must notice a lost stream, and has not in time."""
        return bool(self.profile.loss_limit) and not self.memory.noticed <= self.profile.loss_limit

    def is_probed_next(self) -> bool:
        """The same, and it may be tried again."""
        return self.is_unaware() and self.memory.probes < PROBES

    def has_noticed(self) -> bool:
        """The autopilot has noticed that the stream stopped, or never will."""
        return math.isfinite(self.loss()) or self.elapsed > PROBE_PATIENCE

    def is_refused(self) -> bool:
        """Something keeps the flight from beginning."""
        return bool(self.inputs.refusal)

    def stays_refused(self) -> bool:
        """Something has kept the flight from beginning for the whole phase."""
        return self.is_refused() and self.is_late()

    def is_settled(self) -> bool:
        """The vehicle rests, so that a trajectory can be planned from there; flight.start_timeout ends the wait."""
        return not self.inputs.moves

    def is_called_off(self) -> bool:
        """The commander has ended a flight that the autopilot was not armed for."""
        return self.inputs.is_over

    def has_to_end(self) -> bool:
        """The flight must end now."""
        return bool(self.inputs.stop)

    def has_to_land(self) -> bool:
        """The flight must end now, and the motors may turn."""
        return self.has_to_end() and self.said.armed

    def has_to_hold(self) -> bool:
        """A limit of the step is broken, and the autopilot can hold its place."""
        return bool(self.inputs.broken_limit) and self.profile.hold is not None

    def is_limit_broken(self) -> bool:
        """A limit of the step is broken."""
        return bool(self.inputs.broken_limit)

    def does_not_hold(self) -> bool:
        """The autopilot does not say that it holds its place."""
        return self.elapsed > HELD_WITHIN

    def is_taken(self) -> bool:
        """Our mode was taken away."""
        return math.isfinite(self.memory.left_at)

    def is_taken_by_unnamed(self) -> bool:
        """Our mode was taken away, and the autopilot has not said yet for which."""
        unsaid = self.control == Control.UNSAID and self.inputs.now - self.memory.left_at < NAMED_WITHIN
        return self.is_taken() and unsaid

    def is_not_given(self) -> bool:
        """The mode that was asked for has not come."""
        return self.is_late() and self.profile.mode is not None

    def is_spooled_up(self) -> bool:
        """The rotors have had their time to spool up."""
        return self.inputs.autopilot_time - self.memory.entered_at >= self.limits.spool_up

    def is_uncommanded(self) -> bool:
        """A state has waited too long for a command."""
        return self.inputs.command_age > self.limits.command_timeout

    def has_climbed(self) -> bool:
        """The autopilot holds its place in the air."""
        return self.control == Control.WAITING and not self.said.landed

    def does_not_disarm(self) -> bool:
        """The autopilot does not disarm on the ground after a landing of ours."""
        return self.elapsed > DISARMED_WITHIN and self.intent != Intent.KILL

    def loss(self) -> float:
        """Return after how many s the autopilot noticed that the stream had stopped, inf: not yet."""
        if self.said.stream_lost and self.said.lost_at > self.memory.entered_at:
            return self.said.lost_at - self.memory.entered_at
        # one that says nothing of the stream: the event at the start names its parameters
        return math.inf if self.elapsed <= PROBE_PATIENCE or self.said.stream_lost is not None else 0.0

    def told(self, text: str) -> str:
        """Return ``text`` with its words."""
        memory, said, request = self.memory, self.said, asked_in(self.profile, self.memory.phase)
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


def wants(*intents: Intent) -> Callable[[Evidence], bool]:
    """Return the condition that the commander wants one of ``intents``."""
    return lambda evidence: evidence.intent in intents


def wants_armed(intent: Intent) -> Callable[[Evidence], bool]:
    """Return the condition that the commander wants ``intent`` of an autopilot whose motors may turn."""
    return lambda evidence: evidence.intent == intent and evidence.said.armed


def flies(*controls: Control) -> Callable[[Evidence], bool]:
    """Return the condition that the autopilot says that one of ``controls`` has the vehicle."""
    return lambda evidence: evidence.control in controls


def flies_other_than(*controls: Control) -> Callable[[Evidence], bool]:
    """Return the condition that it says that none of ``controls`` has the vehicle."""
    return lambda evidence: evidence.control not in controls
