"""The last check before the rotors: a good wrench passes, or the backup law flies.

    wrench to the rotors = the controller's, to the bit       in PASS; without a state for 50 ms its thrust alone
                           quad_guard.backup                   in DESCEND
                           none                               in KILL

The vehicle interface (a simulator, a bridge to hardware) calls ``step`` once per plant step, after the newest
wrench and state are in and before the rotors get their command:

    inputs = Inputs(step, period, newest wrench, newest state, request)
    wrench, memory, report = guard.step(parameters, vehicle, memory, inputs, dt)

Time is the vehicle interface's plant step: in lockstep the step itself, in real time the steady clock over the period.
The text is one for both. A refused wrench or sample is dropped, counted and named in the report; it never raises and
never feeds a watchdog. A mode is left upwards only by request, and KILL never. Between samples, and when they stay
away, the state is predicted with the nominal model and, if it still arrives, the measured body rate. Without either,
the prediction is flown for ``state.gone_age``, then the motors are off.
"""

import math
from typing import NamedTuple

from quad_core.enumerations import CommandRefusal, GuardMode, GuardReason, GuardRequest
from quad_core.geometry import ZERO, scale
from quad_core.node_parameters import GuardParameters
from quad_core.types import GuardStatus, Vec3, Wrench
from quad_core.vehicle import Vehicle
from quad_guard.backup import FRESH_DESCENT, Descent, Known, Sight, descend
from quad_guard.checks import (
    StateSample,
    WrenchCommand,
    broken_limit,
    command_refusal,
    is_on_ground,
    within_thrust_range,
)
from quad_guard.state import NO_ESTIMATE, Estimate, Refusals, is_full, is_gone, is_misled, observe, with_belief
from quad_guard.unknown_torque import NO_UNKNOWN_TORQUE, UnknownTorque, advanced, estimated

REASONS: dict[int, str] = {
    GuardReason.GOOD: "good",
    GuardReason.WRENCH_LOST: "no good wrench",
    GuardReason.STATE_LOST: "no good state",
    GuardReason.STATE_REFUSED: "states refused",
    GuardReason.HEADING: "heading",
    GuardReason.TILT: "tilt",
    GuardReason.SPIN: "spin",
    GuardReason.STEP_TILT: "beyond the tilt of the step",
    GuardReason.STEP_SPEED: "beyond the speed of the step",
    GuardReason.STEP_BOX: "out of the box of the step",
    GuardReason.REQUESTED: "on request",
    GuardReason.EXTREME_TILT: "extreme tilt",
    GuardReason.STATE_GONE: "no state at all",
    GuardReason.EXTREME_TILT_LOW: "extreme tilt near the ground",
    GuardReason.REQUESTED_KILL: "kill on request",
}
SETTLE_TIME, RELEASE_COSINE = 0.2, math.cos(math.radians(30.0))
"""The controllers get the vehicle back after so many s with good commands and states, and below a tilt of 30 deg."""
SPIN_RATE, SPIN_TIME = 15.0, 0.03
"""Nothing asks for a yaw rate of so many rad/s for so many s: a rotor is weak, and the law's yaw torque is too."""


class Inputs(NamedTuple):
    """What the guard looks at: the plant step about to be flown, the plant period in ns, what came, what is asked."""

    step: int
    period: int
    command: WrenchCommand
    sample: StateSample
    request: int


class Timers(NamedTuple):
    """For how long in s: large tilt, extreme tilt, spin, everything good enough to be released, on the ground."""

    large_tilt: float
    extreme_tilt: float
    spin: float
    good: float
    on_ground: float


class Memory(NamedTuple):
    """What the guard remembers; steps are -1 before the first time. ``flown`` is the last wrench for the rotors.

    ``answered_step`` is the last step up to which the newest good wrench answered the newest good state. ``home``: the
    place of the first sample.
    """

    mode: int
    reason: int
    since: int
    first_step: int
    wrench: Wrench
    command_step: int
    answered_step: int
    refused_commands: int
    estimate: Estimate
    refusals: Refusals
    timers: Timers
    flown: Wrench
    descent: Descent
    unknown: UnknownTorque
    home: Vec3


class Report(NamedTuple):
    """What the guard did in a step, and which rule refused a wrench and a state: numbers of the words of ``checks``."""

    status: GuardStatus
    command_refusal: int
    state_refusal: int


FRESH_MEMORY = Memory(
    mode=int(GuardMode.PASS),  # of an enumeration Numba finds the type in Python, at every call
    reason=int(GuardReason.GOOD),
    since=0,
    first_step=-1,
    wrench=Wrench(),
    command_step=-1,
    answered_step=-1,
    refused_commands=0,
    estimate=NO_ESTIMATE,
    refusals=Refusals(0, 0, 0, False),
    timers=Timers(0.0, 0.0, 0.0, 0.0, 0.0),
    flown=Wrench(),
    descent=FRESH_DESCENT,
    unknown=NO_UNKNOWN_TORQUE,
    home=ZERO,
)
"""The memory before the first step."""


def step(
    parameters: GuardParameters, vehicle: Vehicle, memory: Memory, inputs: Inputs, dt: float
) -> tuple[Wrench, Memory, Report]:
    """Return the wrench for the rotors, the next memory and the report of one plant step of ``dt`` s.

    Raises nothing, whatever the numbers in ``inputs`` are.
    """
    now, period = inputs.step, inputs.period
    first = memory.first_step if memory.first_step >= 0 else now
    wrench, command_step, refused_command = memory.wrench, memory.command_step, CommandRefusal.ACCEPTED
    if inputs.command.arrived:
        newest = inputs.sample.step if inputs.sample.step < now else now
        refused_command = command_refusal(parameters.command, vehicle, inputs.command, command_step, newest, period)
        if refused_command == CommandRefusal.ACCEPTED:
            wrench, command_step = inputs.command.wrench, inputs.command.step
    refused_commands = memory.refused_commands + (1 if refused_command != CommandRefusal.ACCEPTED else 0)
    before = memory.estimate
    estimate, refusals, refused_state = observe(
        parameters, vehicle, before, memory.refusals, inputs.sample, memory.flown, memory.unknown, now, period, dt
    )
    unknown = observed(parameters, vehicle, memory, estimate, age(now, before.rate_step, first, period))
    answered = answered_until(memory.answered_step, command_step, estimate.step, now)
    command_age = age(now, answered, first, period)
    state_age = age(now, estimate.step, first, period)
    rate_age = age(now, estimate.rate_step, first, period)
    timers = watch(parameters, vehicle, memory, estimate, command_age, state_age, rate_age, dt)
    seen, ground_z = estimate.state, estimate.ground_z
    home = seen.p_w if before.step < 0 else memory.home
    refused = is_full(refusals)
    land = refused and not refusals.reset and state_age <= parameters.state.warn_age
    wrong = condition(
        parameters,
        timers,
        inputs.request,
        command_age,
        state_age,
        is_gone(parameters.state, estimate, rate_age),
        seen.p_w.z - ground_z,
        refused and not (land and parameters.has_commander),
        is_misled(parameters.state, estimate),
        broken_limit(parameters.step, home, ground_z, seen.p_w, seen.v_w, seen.q_wb),
    )
    mode, reason, since = next_mode(memory, timers, inputs.request, wrong, now)
    if mode == GuardMode.PASS and memory.mode != GuardMode.PASS:
        estimate = with_belief(estimate, True)
    flown, descent = fly(parameters, vehicle, memory, mode, wrench, estimate, unknown, state_age, rate_age, dt)
    unknown = advanced(vehicle, unknown, estimate.state.omega_b, flown, dt)
    # fmt: off
    after = Memory(
        mode, reason, since, first, wrench, command_step, answered, refused_commands,
        estimate, refusals, timers, flown, descent, unknown, home,
    )
    status = GuardStatus(
        since, refused_commands, refusals.total, command_age, state_age, mode, reason, wrong,
        command_age > parameters.command.warn_age or state_age > parameters.state.warn_age,
        land, mode == GuardMode.DESCEND and descent.stopped,
        timers.on_ground > 0.0, timers.on_ground >= parameters.contact.time,
    )
    # fmt: on
    return flown, after, Report(status, refused_command, refused_state)


def fly(
    parameters: GuardParameters,
    vehicle: Vehicle,
    memory: Memory,
    mode: int,
    wrench: Wrench,
    estimate: Estimate,
    unknown: UnknownTorque,
    state_age: float,
    rate_age: float,
    dt: float,
) -> tuple[Wrench, Descent]:
    """Return the wrench of ``mode`` and what the backup law remembers; ``wrench`` is the controller's.

    ``unknown``: the torque that the model does not explain.
    """
    height = estimate.state.p_w.z - estimate.ground_z
    if mode == GuardMode.PASS:
        # a torque that answers no accepted state turns the vehicle over within 0.1 s
        thrust = within_thrust_range(parameters, vehicle, wrench.thrust, height)
        if state_age > parameters.state.warn_age:
            return Wrench(thrust, scale(-1.0, unknown.torque)), memory.descent
        return (wrench if thrust == wrench.thrust else Wrench(thrust, wrench.torque_b)), memory.descent
    if mode == GuardMode.KILL:
        return Wrench(0.0, ZERO), memory.descent
    descent = memory.descent if memory.mode == GuardMode.DESCEND else FRESH_DESCENT
    sight = Sight.BLIND
    if estimate.step >= 0 and state_age <= parameters.state.lost_age:
        sight = Sight.SEES if estimate.knows_heading else Sight.NO_HEADING
    elif rate_age <= parameters.state.blind_age or estimate.step < 0:
        sight = Sight.TURNS
    return descend(
        parameters.contact,
        vehicle,
        descent,
        estimate.state,
        height,
        Known(sight, rate_age, unknown, estimate.evidence.strength, memory.flown.thrust),
        dt,
    )


def observed(
    parameters: GuardParameters, vehicle: Vehicle, memory: Memory, estimate: Estimate, rate_age: float
) -> UnknownTorque:
    """Return what is known of the torque that no wrench explains; ``rate_age`` s: of the body rate before this step."""
    before = memory.estimate
    if estimate.rate_step == before.rate_step or estimate.reading == before.reading:
        return memory.unknown
    # what stands on something is held by it: its torque is no rotor's
    flies = (
        memory.descent.rest_time == 0.0 and estimate.state.p_w.z - estimate.ground_z > parameters.contact.stop_height
    )
    follows = flies and before.step >= 0 and rate_age <= parameters.state.warn_age
    return estimated(vehicle, memory.unknown, estimate.reading, follows)


def age(now: int, since: int, first: int, period: int) -> float:
    """Return the age in s at step ``now`` of what is of step ``since``; of what never came: since ``first``."""
    return 0.0 if since == now else (now - (since if since >= 0 else first)) * period / 1e9


def answered_until(before: int, command_step: int, state_step: int, now: int) -> int:
    """Return the last step, up to ``now``, at which the newest wrench was no older than the newest state.

    ``before`` is what the step before knew; the wrench answers the state of ``command_step``.
    """
    if state_step <= command_step:
        return now
    return before if before > command_step else command_step


def watch(
    parameters: GuardParameters,
    vehicle: Vehicle,
    memory: Memory,
    estimate: Estimate,
    command_age: float,
    state_age: float,
    rate_age: float,
    dt: float,
) -> Timers:
    """Return the timers after a step of ``dt`` s; ages in s. A prediction without body rates is no tilt."""
    q, timers = estimate.state.q_wb, memory.timers
    cosine = 1.0 - 2.0 * (q.x * q.x + q.y * q.y)
    height = estimate.state.p_w.z - estimate.ground_z
    good = (
        command_age <= parameters.command.warn_age
        and state_age <= parameters.state.warn_age
        and cosine >= RELEASE_COSINE
    )
    stands = (
        estimate.step >= 0
        and state_age <= parameters.state.warn_age
        and is_on_ground(parameters.contact, vehicle, estimate.state, height, memory.flown.thrust)
    )
    is_seen = rate_age <= parameters.state.blind_age
    return Timers(
        timers.large_tilt + dt if is_seen and cosine < math.cos(parameters.tilt.large) else 0.0,
        timers.extreme_tilt + dt if is_seen and cosine < math.cos(parameters.tilt.extreme) else 0.0,
        timers.spin + dt if is_seen and abs(estimate.state.omega_b.z) > SPIN_RATE else 0.0,
        timers.good + dt if good else 0.0,
        timers.on_ground + dt if stands else 0.0,
    )


def condition(
    parameters: GuardParameters,
    timers: Timers,
    request: int,
    command_age: float,
    state_age: float,
    gone: bool,
    height: float,
    refused: bool,
    misled: bool,
    beyond: GuardReason,
) -> int:
    """Return the most severe of what is wrong now (``REASONS``); ages in s, ``height`` in m above the ground.

    ``beyond``: which limit of the step the vehicle is beyond, GOOD: none.
    """
    tilt, found = parameters.tilt, GuardReason.GOOD
    if command_age > parameters.command.lost_age:
        found = GuardReason.WRENCH_LOST
    if state_age > parameters.state.lost_age:
        found = GuardReason.STATE_LOST
    if refused:
        found = GuardReason.STATE_REFUSED
    if misled:
        found = GuardReason.HEADING
    if timers.large_tilt > tilt.large_time:
        found = GuardReason.TILT
    if timers.spin > SPIN_TIME:
        found = GuardReason.SPIN
    if beyond != GuardReason.GOOD:
        found = beyond
    if request == GuardRequest.DESCEND:
        found = GuardReason.REQUESTED
    if timers.extreme_tilt > tilt.extreme_time:
        found = GuardReason.EXTREME_TILT_LOW if height < tilt.low_height else GuardReason.EXTREME_TILT
    if gone and found < GuardReason.STATE_GONE:
        found = GuardReason.STATE_GONE
    if request == GuardRequest.KILL:
        found = GuardReason.REQUESTED_KILL
    return found


def next_mode(memory: Memory, timers: Timers, request: int, wrong: int, now: int) -> tuple[int, int, int]:
    """Return mode, reason and the step since which it holds: the more severe wins, upwards only by request."""
    asked = GuardMode.PASS
    if wrong >= GuardReason.STATE_GONE:
        asked = GuardMode.KILL
    elif wrong != GuardReason.GOOD:
        asked = GuardMode.DESCEND
    if asked > memory.mode:
        return asked, wrong, now
    if (
        memory.mode == GuardMode.DESCEND
        and asked == GuardMode.PASS
        and request == GuardRequest.RELEASE
        and timers.good >= SETTLE_TIME
    ):
        return GuardMode.PASS, GuardReason.GOOD, now
    return memory.mode, memory.reason, memory.since
