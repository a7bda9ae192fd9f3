"""From the ground to the flight and back, with the autopilot's own reasons where it refuses.

::

    STREAM -> PROBE -> STREAM -> MODE -> ARM -> SPOOL_UP -> FLY -> LAND -> LANDED
                any of them -> RELEASED: quiet for good, nothing is asked of the autopilot again

With a commander (``Inputs.wish``) the sequence stands in STANDBY until it is to arm, an own take-off of the autopilot
is CLIMB -> RETURN -> FLY, and after a landing of ours FLY -> DISARM -> LANDED.

``step`` is called every 20 ms and is pure. An autopilot leaves the offboard mode by itself a while after the last
heartbeat (PX4: COM_OF_LOSS_T, 1.0 s unless set), and follows the last setpoint until then. As long as heartbeats come
it follows stale setpoints: so the heartbeat stops with the controller, and the autopilot is asked to land at once. An
autopilot that stabilises nothing itself must notice a lost stream within ``Profile.loss_limit``: PROBE stops the stream
on the ground and measures that time. After the mode was taken away nothing more goes out, even while the autopilot has
not yet said which mode it is in.
"""

import math
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
    taken,
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


class Wish(IntEnum):
    """What the flight wants of the autopilot now; a flight without commander wants FLY throughout."""

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


_AT_IDLE = (Wish.GROUND, Wish.IDLE, Wish.CLIMB)


class Setpoint(IntEnum):
    """What goes to the autopilot with or without a heartbeat."""

    NONE = 0
    IDLE = 1
    COMMAND = 2
    LEVEL = 3


class Inputs(NamedTuple):
    """What is known now. Times and ages in s; an age is infinite before the first message.

    ``now`` is the steady clock, ``autopilot_time`` the autopilot's own. ``command_age``: for how long a state
    has waited for a command. ``refusal``: why the flight must not begin, empty if it may. ``stop``: why it must end
    now, empty if it need not. ``ended``: it has flown to its planned end. ``silence``: time since the autopilot sent
    anything.
    """

    now: float
    autopilot_time: float
    autopilot: Autopilot | None
    ack: Ack | None = None
    command_age: float = math.inf
    state_age: float = math.inf
    refusal: str = ""
    stop: str = ""
    ended: bool = False
    silence: float = 0.0
    wish: Wish = Wish.FLY


class Memory(NamedTuple):
    """``since``: steady s at which the phase began; ``answer``: the last that the autopilot said to its request.

    ``left_at``: steady s at which the mode was ours no more, infinite before. ``noticed``: least time in s in which the
    autopilot noticed that the stream had stopped, NaN before PROBE. ``usual``: what it said against a flight at its
    begin.
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
    failed: bool = False
    noticed: float = math.nan
    probes: int = 0
    usual: tuple[str, ...] = ()


class Output(NamedTuple):
    """What to send now. ``reason`` is why the flight ends; ``failed`` whether that is no good end."""

    phase: Phase
    heartbeat: bool
    setpoint: Setpoint
    request: Request | None
    reason: str
    failed: bool


def step(profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> tuple[Output, Memory]:
    """Return what to send, and the next memory; ``profile`` says how this autopilot is asked."""
    if memory.since < 0.0:
        memory = memory._replace(since=inputs.now)
    memory = _answered(profile, memory, inputs)
    following = _next(profile, parameters, memory, inputs)
    if following.phase != memory.phase:
        following = following._replace(
            since=inputs.now, asked_at=-math.inf, attempts=0, answer="", spooled_from=inputs.autopilot_time
        )
    request, following = _request(profile, parameters, following, inputs)
    heartbeat, setpoint = _stream(parameters, following, inputs)
    following = following._replace(beats=following.beats + int(heartbeat))
    return Output(following.phase, heartbeat, setpoint, request, following.reason, following.failed), following


def _asked_in(profile: Profile, phase: Phase) -> Request | None:
    return {
        Phase.MODE: profile.mode,
        Phase.ARM: profile.arm,
        Phase.LAND: profile.land,
        Phase.CLIMB: profile.takeoff,
        Phase.RETURN: profile.mode,
        Phase.DISARM: profile.disarm,
    }.get(phase)


def _asked_for(profile: Profile, phase: Phase) -> str:
    request = _asked_in(profile, phase)
    return COMMANDS.get(request.command, str(request.command)) if request else ""


def _answered(profile: Profile, memory: Memory, inputs: Inputs) -> Memory:
    request = _asked_in(profile, memory.phase)
    if inputs.ack is None or request is None or inputs.ack.command != request.command:
        return memory
    if inputs.ack.result == IN_PROGRESS:
        return memory
    known = 0 <= inputs.ack.result < len(RESULTS)
    return memory._replace(answer=RESULTS[inputs.ack.result] if known else f"result {inputs.ack.result}")


def _next(profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> Memory:
    """Return the memory with the phase that follows now."""
    phase = memory.phase
    if phase in (Phase.LANDED, Phase.RELEASED):
        return memory
    if phase == Phase.STREAM:
        return _streaming(profile, parameters, memory, inputs)
    if inputs.autopilot is None:  # known since STREAM
        return memory
    if phase == Phase.PROBE:
        return _probing(profile, memory, inputs, inputs.autopilot)
    if inputs.wish == Wish.KILL and phase not in (Phase.STANDBY, Phase.DISARM):
        return memory._replace(phase=Phase.DISARM)
    if phase == Phase.STANDBY:
        return _standing_by(profile, memory, inputs, inputs.autopilot)
    if phase in (Phase.MODE, Phase.ARM, Phase.SPOOL_UP):
        return _preparing(profile, parameters, memory, inputs, inputs.autopilot)
    if phase in (Phase.CLIMB, Phase.RETURN):
        return _climbing(profile, parameters, memory, inputs, inputs.autopilot)
    if phase == Phase.DISARM:
        return _disarming(profile, memory, inputs, inputs.autopilot)
    if phase == Phase.FLY:
        return _flying(profile, parameters, memory, inputs, inputs.autopilot)
    return _landing(profile, parameters, memory, inputs, inputs.autopilot)


def _streaming(profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> Memory:
    late = inputs.now - memory.since > parameters.step_timeout
    if inputs.stop:
        return _release(memory, inputs.stop)
    if inputs.autopilot is None:
        return _release(memory, f"no {profile.status} from {profile.name}: {profile.hint}") if late else memory
    if inputs.autopilot.armed:
        return _release(memory, f"{profile.name} is armed already, in {inputs.autopilot.mode}: disarm it first")
    if inputs.state_age > parameters.state_timeout:
        return _release(memory, f"no {profile.state} from {profile.name} that can be accepted") if late else memory
    if memory.beats < parameters.beats:
        return memory
    if profile.loss_limit and memory.probes < PROBES and not memory.noticed <= profile.loss_limit:
        return memory._replace(phase=Phase.PROBE, probes=memory.probes + 1)
    refusal = inputs.refusal
    if profile.loss_limit and memory.noticed > profile.loss_limit:
        after = "not" if math.isinf(memory.noticed) else f"after {memory.noticed:.2f} s"
        refusal = (
            f"{profile.name} noticed {after} that the stream of setpoints had stopped, expected within "
            f"{profile.loss_limit:g} s: {profile.loss_advice}"
        )
        late = True
    if refusal:
        return _release(memory, f"arming refused: {refusal}") if late else memory
    return memory._replace(phase=Phase.STANDBY if inputs.wish == Wish.GROUND else Phase.MODE)


def _standing_by(profile: Profile, memory: Memory, inputs: Inputs, autopilot: Autopilot) -> Memory:
    """Return the next memory on the ground, until the commander arms."""
    if inputs.stop:
        return _release(memory, inputs.stop)
    if autopilot.armed:
        return _release(memory, f"{profile.name} was armed in {autopilot.mode} before the flight")
    return memory._replace(phase=Phase.MODE) if Wish.IDLE <= inputs.wish <= Wish.CLIMB else memory


def _probing(profile: Profile, memory: Memory, inputs: Inputs, autopilot: Autopilot) -> Memory:
    """Return the next memory while no stream goes out: back to STREAM with the time that the autopilot took."""
    if inputs.stop:
        return _release(memory, inputs.stop)
    if autopilot.armed:
        return _release(memory, f"{profile.name} was armed in {autopilot.mode} before the flight")
    noticed = math.inf
    if autopilot.stream_lost and autopilot.lost_at > memory.spooled_from:
        noticed = autopilot.lost_at - memory.spooled_from
    elif inputs.now - memory.since <= PROBE_PATIENCE:
        return memory
    elif autopilot.stream_lost is None:
        noticed = 0.0  # it says nothing of the stream: the event at the start names the parameters
    quickest = noticed if math.isnan(memory.noticed) else min(noticed, memory.noticed)
    return memory._replace(phase=Phase.STREAM, beats=0, noticed=quickest)


def _preparing(
    profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs, autopilot: Autopilot
) -> Memory:
    """Return the next memory between the first request and the flight."""
    phase, armed = memory.phase, autopilot.armed
    if phase != Phase.MODE and _is_left(memory, autopilot):
        return _leave(profile, memory, inputs, autopilot, "before the flight")
    if inputs.stop:
        return _land(profile, memory, inputs.stop) if armed else _release(memory, inputs.stop)
    if inputs.wish == Wish.GROUND:
        return memory._replace(phase=Phase.DISARM if armed else Phase.STANDBY)
    if phase == Phase.MODE and autopilot.control == Control.OURS:
        return memory._replace(phase=Phase.ARM)
    if phase == Phase.ARM and armed:
        return memory._replace(phase=Phase.SPOOL_UP)
    if phase == Phase.SPOOL_UP:
        if not armed:
            return _release(memory, f"{profile.name} disarmed while the rotors spooled up{because(autopilot)}")
        if inputs.state_age > parameters.state_timeout:
            return _land(profile, memory, f"{profile.state}: nothing for {inputs.state_age:.2f} s")
        spooled = inputs.autopilot_time - memory.spooled_from >= parameters.spool_up
        return memory._replace(phase=Phase.FLY, usual=autopilot.reasons) if spooled else memory
    if inputs.now - memory.since > parameters.step_timeout and not (phase == Phase.MODE and profile.mode is None):
        what = f"change to {profile.offboard}" if phase == Phase.MODE else "arm"
        answer = memory.answer or "never acknowledged (is target_system right?)"
        text = (
            f"{profile.name} did not {what} within {parameters.step_timeout:g} s: {_asked_for(profile, phase)} {answer}"
        )
        return _release(memory, text + because(autopilot))
    return memory


def _flying(
    profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs, autopilot: Autopilot
) -> Memory:
    """Return the next memory in flight: the autopilot comes first, then what is lost, then the planned end."""
    if not autopilot.armed:
        return _release(memory, f"{profile.name} disarmed in flight{because(autopilot, memory.usual)}")
    if _is_left(memory, autopilot):
        return _leave(profile, memory, inputs, autopilot, "in flight")
    if inputs.stop:
        return _land(profile, memory, inputs.stop)
    if inputs.state_age > parameters.state_timeout:
        return _land(profile, memory, f"{profile.state}: nothing for {inputs.state_age:.2f} s")
    if inputs.command_age > _patience(parameters, memory, inputs):
        silent = min(inputs.command_age, inputs.now - memory.since)
        return _land(profile, memory, f"controllers: no command for {1e3 * silent:.0f} ms")
    if inputs.wish == Wish.GROUND:
        return memory._replace(phase=Phase.DISARM)
    if inputs.wish == Wish.CLIMB:
        return memory._replace(phase=Phase.CLIMB)
    lands = inputs.ended or inputs.wish == Wish.LAND
    return memory._replace(phase=Phase.LAND, reason="", failed=False) if lands else memory


def _climbing(
    profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs, autopilot: Autopilot
) -> Memory:
    """Return the next memory while the autopilot takes off by itself, and while it is asked to follow us again."""
    if not autopilot.armed:
        return _release(memory, f"{profile.name} disarmed during its take-off{because(autopilot, memory.usual)}")
    if inputs.stop or inputs.wish in (Wish.GROUND, Wish.LAND):
        return _land(profile, memory, inputs.stop or "landing asked for during the take-off")
    late = inputs.now - memory.since > parameters.land_timeout
    if memory.phase == Phase.CLIMB:
        if autopilot.control == Control.OTHER:
            return _release(memory, taken(profile, autopilot, "during its take-off", memory.usual))
        if autopilot.control == Control.WAITING and not autopilot.landed:
            return memory._replace(phase=Phase.RETURN)
        return _land(profile, memory, f"{profile.name}: no end of its take-off, {memory.answer}") if late else memory
    if autopilot.control == Control.OURS:
        return memory._replace(phase=Phase.FLY)
    if autopilot.control not in (Control.WAITING, Control.UNSAID):
        return _release(memory, taken(profile, autopilot, "after its take-off", memory.usual))
    late = inputs.now - memory.since > parameters.step_timeout
    text = f"{profile.name} did not change to {profile.offboard} after its take-off: {memory.answer}"
    return _land(profile, memory, text) if late else memory


def _disarming(profile: Profile, memory: Memory, inputs: Inputs, autopilot: Autopilot) -> Memory:
    """Return the next memory on the ground; an autopilot that does not see the ground lands by itself."""
    if not autopilot.armed:
        return memory._replace(phase=Phase.LANDED)
    late = inputs.now - memory.since > DISARMED_WITHIN and inputs.wish != Wish.KILL
    text = f"{profile.name} does not disarm: {memory.answer or 'never acknowledged'}"
    return memory._replace(phase=Phase.LAND, reason=text) if late else memory


def _landing(
    profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs, autopilot: Autopilot
) -> Memory:
    if not autopilot.armed:
        return memory._replace(phase=Phase.LANDED)
    if autopilot.control not in (Control.OURS, Control.LANDING, Control.UNSAID):
        return _release(memory, _both(memory.reason, taken(profile, autopilot, "while landing", memory.usual)))
    if inputs.silence > SILENT_FOR:
        text = f"nothing heard from {profile.name} for {inputs.silence:.0f} s"
        return _release(memory, _both(memory.reason, f"{text}: it lands by its own failsafe, unseen"))
    if inputs.now - memory.since > parameters.land_timeout:
        text = f"not landed after {parameters.land_timeout:g} s: NAV_LAND {memory.answer or 'never acknowledged'}"
        return _release(memory, _both(memory.reason, f"{text}; {profile.name} is in {autopilot.mode} and still armed"))
    return memory


def _is_left(memory: Memory, autopilot: Autopilot) -> bool:
    return autopilot.control != Control.OURS or not math.isinf(memory.left_at)


def _leave(profile: Profile, memory: Memory, inputs: Inputs, autopilot: Autopilot, when: str) -> Memory:
    """Return the memory of a mode that was taken away: silent from now on, released once it is known who has it."""
    memory = memory._replace(left_at=min(memory.left_at, inputs.now))
    if autopilot.control == Control.UNSAID and inputs.now - memory.left_at < NAMED_WITHIN:
        return memory
    return _release(memory, taken(profile, autopilot, when, memory.usual))


def _patience(parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> float:
    """Return the largest age of a command; the first may take longer, for the vehicle stands on the ground."""
    starting = math.isinf(inputs.command_age) and inputs.now - memory.since <= parameters.first_command
    return math.inf if starting else parameters.command_timeout


def _request(
    profile: Profile, parameters: ArmingParameters, memory: Memory, inputs: Inputs
) -> tuple[Request | None, Memory]:
    """Return the request that is due; one without an effect is repeated."""
    request = _asked_in(profile, memory.phase)
    control = inputs.autopilot.control if inputs.autopilot is not None else Control.OTHER
    done = {Phase.LAND: (Control.LANDING, Control.UNSAID), Phase.CLIMB: (Control.CLIMBING, Control.WAITING)}
    if request is None or not math.isinf(memory.left_at) or control in done.get(memory.phase, ()):
        return None, memory
    if inputs.now - memory.asked_at < parameters.answer_timeout:
        return None, memory
    asked = request._replace(attempt=memory.attempts)
    if memory.phase == Phase.DISARM and inputs.wish == Wish.KILL:
        asked = asked._replace(param2=FORCE)
    return asked, memory._replace(asked_at=inputs.now, attempts=memory.attempts + 1)


def _stream(parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> tuple[bool, Setpoint]:
    """Return whether a heartbeat goes out, and what setpoint."""
    if not math.isinf(memory.left_at):
        return False, Setpoint.NONE
    if memory.phase <= Phase.SPOOL_UP or memory.phase == Phase.STANDBY:
        return True, Setpoint.IDLE
    if memory.phase == Phase.DISARM:
        return inputs.wish != Wish.KILL, Setpoint.IDLE
    if memory.phase == Phase.CLIMB:
        return True, Setpoint.IDLE
    if memory.phase == Phase.RETURN:
        return inputs.command_age <= parameters.command_timeout, Setpoint.COMMAND
    offboard = inputs.autopilot is not None and inputs.autopilot.control == Control.OURS
    if memory.phase not in (Phase.FLY, Phase.LAND) or not offboard:
        return False, Setpoint.NONE
    if math.isinf(inputs.command_age) or (memory.phase == Phase.FLY and inputs.wish in _AT_IDLE):
        return memory.phase == Phase.FLY, Setpoint.IDLE
    fresh = inputs.command_age <= parameters.command_timeout
    if memory.failed or not fresh:
        return False, Setpoint.LEVEL
    return True, Setpoint.COMMAND


def _land(profile: Profile, memory: Memory, reason: str) -> Memory:
    return memory._replace(phase=Phase.LAND, reason=f"{reason}; {profile.name} lands", failed=True)


def _release(memory: Memory, reason: str) -> Memory:
    return memory._replace(phase=Phase.RELEASED, reason=reason, failed=True)


def _both(first: str, second: str) -> str:
    return f"{first}; {second}" if first else second
