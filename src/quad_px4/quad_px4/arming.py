"""From the ground to the flight and back, with PX4's own reasons where it refuses.

::

    STREAM -> MODE -> ARM -> SPOOL_UP -> FLY -> LAND -> LANDED
                any of them -> RELEASED: quiet for good, nothing is asked of PX4 again

``step`` is called every 20 ms and is pure. PX4 leaves offboard by itself 1.0 s (COM_OF_LOSS_T) after the last
heartbeat, but as long as heartbeats come it obeys stale setpoints: so the heartbeat stops with the controller, and PX4
is asked to land at once. Whoever takes the mode away has it.
"""

import math
from enum import IntEnum
from typing import NamedTuple

from quad_core.px4_parameters import ArmingParameters
from quad_px4.autopilot import (
    ARM_DISARM,
    ARMED,
    COMMANDS,
    DO_SET_MODE,
    IN_PROGRESS,
    LANDING,
    NAV_LAND,
    OFFBOARD,
    RESULTS,
    Ack,
    Autopilot,
    Request,
    because,
    mode_name,
    taken,
)


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


class Setpoint(IntEnum):
    """What goes to PX4 with or without a heartbeat."""

    NONE = 0
    IDLE = 1
    COMMAND = 2
    LEVEL = 3


REQUESTS = {
    Phase.MODE: Request(DO_SET_MODE, 1.0, 6.0),
    Phase.ARM: Request(ARM_DISARM, 1.0),
    Phase.LAND: Request(NAV_LAND),
}


class Inputs(NamedTuple):
    """What is known now. Times and ages in s; an age is infinite before the first message.

    ``now`` is the steady clock, ``px4_time`` PX4's own. ``refusal``: why the flight must not begin, empty if it may.
    ``stop``: why the flight must end now, empty if it need not. ``ended``: it has flown to its planned end.
    """

    now: float
    px4_time: float
    autopilot: Autopilot | None
    ack: Ack | None = None
    command_age: float = math.inf
    state_age: float = math.inf
    refusal: str = ""
    stop: str = ""
    ended: bool = False


class Memory(NamedTuple):
    """``since``: steady s at which the phase began; ``answer``: the last that PX4 said to its request."""

    phase: Phase = Phase.STREAM
    since: float = -1.0
    beats: int = 0
    asked_at: float = -math.inf
    attempts: int = 0
    answer: str = ""
    spooled_from: float = 0.0
    reason: str = ""
    failed: bool = False


class Output(NamedTuple):
    """What to send now. ``reason`` is why the flight ends; ``failed`` whether that is no good end."""

    phase: Phase
    heartbeat: bool
    setpoint: Setpoint
    request: Request | None
    reason: str
    failed: bool


def step(parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> tuple[Output, Memory]:
    """Return what to send, and the next memory."""
    if memory.since < 0.0:
        memory = memory._replace(since=inputs.now)
    memory = _answered(memory, inputs)
    following = _next(parameters, memory, inputs)
    if following.phase != memory.phase:
        following = following._replace(
            since=inputs.now, asked_at=-math.inf, attempts=0, answer="", spooled_from=inputs.px4_time
        )
    request, following = _request(parameters, following, inputs)
    heartbeat, setpoint = _stream(parameters, following, inputs)
    following = following._replace(beats=following.beats + int(heartbeat))
    return Output(following.phase, heartbeat, setpoint, request, following.reason, following.failed), following


def _answered(memory: Memory, inputs: Inputs) -> Memory:
    request = REQUESTS.get(memory.phase)
    if inputs.ack is None or request is None or inputs.ack.command != request.command:
        return memory
    if inputs.ack.result == IN_PROGRESS:
        return memory
    known = 0 <= inputs.ack.result < len(RESULTS)
    return memory._replace(answer=RESULTS[inputs.ack.result] if known else f"result {inputs.ack.result}")


def _next(parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> Memory:
    """Return the memory with the phase that follows now."""
    phase = memory.phase
    if phase in (Phase.LANDED, Phase.RELEASED):
        return memory
    if phase == Phase.STREAM:
        return _streaming(parameters, memory, inputs)
    if inputs.autopilot is None:  # known since STREAM
        return memory
    if phase in (Phase.MODE, Phase.ARM, Phase.SPOOL_UP):
        return _preparing(parameters, memory, inputs, inputs.autopilot)
    if phase == Phase.FLY:
        return _flying(parameters, memory, inputs, inputs.autopilot)
    return _landing(parameters, memory, inputs, inputs.autopilot)


def _streaming(parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> Memory:
    late = inputs.now - memory.since > parameters.step_timeout
    if inputs.stop:
        return _release(memory, inputs.stop)
    if inputs.autopilot is None:
        return _release(memory, "no vehicle_status from PX4: is its uXRCE-DDS agent running?") if late else memory
    if inputs.autopilot.arming_state == ARMED:
        return _release(memory, f"PX4 is armed already, in {mode_name(inputs.autopilot)}: disarm it first")
    if inputs.state_age > parameters.state_timeout:
        return _release(memory, "no vehicle_odometry from PX4 that can be believed") if late else memory
    if memory.beats < parameters.beats:
        return memory
    if inputs.refusal:
        return _release(memory, f"arming refused: {inputs.refusal}") if late else memory
    return memory._replace(phase=Phase.MODE)


def _preparing(parameters: ArmingParameters, memory: Memory, inputs: Inputs, autopilot: Autopilot) -> Memory:
    """Return the next memory between the first request and the flight."""
    phase, armed = memory.phase, autopilot.arming_state == ARMED
    if inputs.stop:
        return _land(memory, inputs.stop) if armed else _release(memory, inputs.stop)
    if phase != Phase.MODE and autopilot.nav_state != OFFBOARD:
        return _release(memory, taken(autopilot, "before the flight"))
    if phase == Phase.MODE and autopilot.nav_state == OFFBOARD:
        return memory._replace(phase=Phase.ARM)
    if phase == Phase.ARM and armed:
        return memory._replace(phase=Phase.SPOOL_UP)
    if phase == Phase.SPOOL_UP:
        if not armed:
            return _release(memory, f"PX4 disarmed while the rotors spooled up{because(autopilot)}")
        if inputs.state_age > parameters.state_timeout:
            return _land(memory, f"vehicle_odometry: nothing for {inputs.state_age:.2f} s")
        spooled = inputs.px4_time - memory.spooled_from >= parameters.spool_up
        return memory._replace(phase=Phase.FLY) if spooled else memory
    if inputs.now - memory.since > parameters.step_timeout:
        what = "change to offboard" if phase == Phase.MODE else "arm"
        answer = memory.answer or "never acknowledged (is target_system right?)"
        text = f"PX4 did not {what} within {parameters.step_timeout:g} s: {COMMANDS[REQUESTS[phase].command]} {answer}"
        return _release(memory, text + because(autopilot))
    return memory


def _flying(parameters: ArmingParameters, memory: Memory, inputs: Inputs, autopilot: Autopilot) -> Memory:
    """Return the next memory in flight: PX4 comes first, then what is lost, then the planned end."""
    if autopilot.arming_state != ARMED:
        return _release(memory, f"PX4 disarmed in flight{because(autopilot)}")
    if autopilot.nav_state != OFFBOARD:
        return _release(memory, taken(autopilot, "in flight"))
    if inputs.stop:
        return _land(memory, inputs.stop)
    if inputs.state_age > parameters.state_timeout:
        return _land(memory, f"vehicle_odometry: nothing for {inputs.state_age:.2f} s")
    if inputs.command_age > _patience(parameters, memory, inputs):
        return _land(
            memory, f"controllers: no command for {1e3 * min(inputs.command_age, inputs.now - memory.since):.0f} ms"
        )
    return memory._replace(phase=Phase.LAND, reason="", failed=False) if inputs.ended else memory


def _landing(parameters: ArmingParameters, memory: Memory, inputs: Inputs, autopilot: Autopilot) -> Memory:
    if autopilot.arming_state != ARMED:
        return memory._replace(phase=Phase.LANDED)
    if autopilot.nav_state not in (OFFBOARD, *LANDING):
        return _release(memory, _both(memory.reason, taken(autopilot, "while landing")))
    if inputs.now - memory.since > parameters.land_timeout:
        text = f"not landed after {parameters.land_timeout:g} s: NAV_LAND {memory.answer or 'never acknowledged'}"
        return _release(memory, _both(memory.reason, f"{text}; PX4 is in {mode_name(autopilot)} and still armed"))
    return memory


def _patience(parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> float:
    """Return the largest age of a command; the first may take longer, for the vehicle stands on the ground."""
    starting = math.isinf(inputs.command_age) and inputs.now - memory.since <= parameters.first_command
    return math.inf if starting else parameters.command_timeout


def _request(parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> tuple[Request | None, Memory]:
    """Return the request that is due; one without an effect is repeated."""
    request = REQUESTS.get(memory.phase)
    landing = inputs.autopilot is not None and inputs.autopilot.nav_state in LANDING
    if request is None or (memory.phase == Phase.LAND and landing):
        return None, memory
    if inputs.now - memory.asked_at < parameters.answer_timeout:
        return None, memory
    asked = request._replace(attempt=memory.attempts)
    return asked, memory._replace(asked_at=inputs.now, attempts=memory.attempts + 1)


def _stream(parameters: ArmingParameters, memory: Memory, inputs: Inputs) -> tuple[bool, Setpoint]:
    """Return whether a heartbeat goes out, and what setpoint."""
    if memory.phase <= Phase.SPOOL_UP:
        return True, Setpoint.IDLE
    offboard = inputs.autopilot is not None and inputs.autopilot.nav_state == OFFBOARD
    if memory.phase not in (Phase.FLY, Phase.LAND) or not offboard:
        return False, Setpoint.NONE
    if math.isinf(inputs.command_age):
        return memory.phase == Phase.FLY, Setpoint.IDLE
    fresh = inputs.command_age <= parameters.command_timeout
    if memory.failed or not fresh:
        return False, Setpoint.LEVEL
    return True, Setpoint.COMMAND


def _land(memory: Memory, reason: str) -> Memory:
    return memory._replace(phase=Phase.LAND, reason=f"{reason}; PX4 lands", failed=True)


def _release(memory: Memory, reason: str) -> Memory:
    return memory._replace(phase=Phase.RELEASED, reason=reason, failed=True)


def _both(first: str, second: str) -> str:
    return f"{first}; {second}" if first else second
