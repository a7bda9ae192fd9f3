"""What a wrench and a state sample must be before the guard accepts them, and what a first flight in steps may do.

A check returns 0 (``ACCEPTED``) or the number of the first rule that is broken; ``COMMAND_REFUSALS`` and
``STATE_REFUSALS`` hold the words. Time is the vehicle interface's plant step: age = (step - stamp's step) * period, in
lockstep and in real time alike.
"""

import math
from typing import NamedTuple

from quad_core.cycle import is_flyable
from quad_core.enumerations import CommandRefusal, GuardReason, StateRefusal
from quad_core.geometry import body_z, clamp, norm, scale
from quad_core.node_parameters import CommandLimits, ContactRule, GuardParameters, StateLimits, StepLimits
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Layout, Vehicle, max_thrust

COMMAND_REFUSALS: dict[int, str] = {
    CommandRefusal.ACCEPTED: "accepted",
    CommandRefusal.NOT_FINITE: "a number that is not finite",
    CommandRefusal.NOT_NEWER: "not newer than the last",
    CommandRefusal.AHEAD: "an answer to a state that is not published yet",
    CommandRefusal.TOO_OLD: "too old when it arrived",
    CommandRefusal.THRUST: "thrust beyond the vehicle's limits",
    CommandRefusal.TORQUE: "torque beyond the vehicle's limits",
}
STATE_REFUSALS: dict[int, str] = {
    StateRefusal.ACCEPTED: "accepted",
    StateRefusal.NOT_FINITE: "not finite or out of bounds",
    StateRefusal.NOT_NEWER: "not newer than the last",
    StateRefusal.AHEAD: "a stamp ahead of the vehicle's time",
    StateRefusal.POSITION_JUMP: "a jump in position",
    StateRefusal.ATTITUDE_JUMP: "a jump in attitude",
    StateRefusal.FROZEN: "frozen",
}
DIAGONAL = math.sqrt(0.5)
THRUST_MARGIN, TORQUE_MARGIN = 2.0, 100.0
"""A wrench is refused beyond so many times the largest thrust, or the largest torque about an axis, of four rotors."""


class BodyState(NamedTuple):
    """Position m and velocity m/s (world), attitude and body rates rad/s, without the ages of a state."""

    p_w: Vec3
    v_w: Vec3
    q_wb: Quat
    omega_b: Vec3


class WrenchCommand(NamedTuple):
    """The newest wrench that the vehicle interface has; it stays the same until another arrives.

    ``step`` is that of the state from which it was computed. ``arrived``: since the guard's last step.
    """

    wrench: Wrench = Wrench()
    step: int = 0
    arrived: bool = False


class StateSample(NamedTuple):
    """The newest state that the vehicle interface has, and its step; ``arrived``: since the guard's last step."""

    state: VehicleState = VehicleState()
    step: int = 0
    arrived: bool = False


def largest_torque(vehicle: Vehicle) -> Vec3:
    """Return the largest torque in N m that four rotors make about each body axis (Eqs. 3, 8)."""
    rotor = 0.25 * max_thrust(vehicle)
    tilting = rotor * vehicle.arm_length
    if vehicle.layout == Layout.X:
        tilting = 2.0 * DIAGONAL * tilting
    return Vec3(tilting, tilting, 2.0 * rotor * vehicle.torque_coefficient / vehicle.lift_coefficient)


def command_refusal(
    limits: CommandLimits, vehicle: Vehicle, command: WrenchCommand, last_step: int, newest: int, period: int
) -> CommandRefusal:
    """Return why ``command`` is refused, or ACCEPTED; ``period`` in ns.

    ``last_step`` is the step of the last accepted command, ``newest`` that of the newest state that was published:
    a command answers a state, so none is ahead of it, and an answer to the newest one is not late.
    """
    wrench, torque = command.wrench, command.wrench.torque_b
    if not math.isfinite(wrench.thrust + torque.x + torque.y + torque.z):
        return CommandRefusal.NOT_FINITE
    if command.step <= last_step:
        return CommandRefusal.NOT_NEWER
    if command.step > newest:
        return CommandRefusal.AHEAD
    if (newest - command.step) * period / 1e9 > limits.too_old:
        return CommandRefusal.TOO_OLD
    if abs(wrench.thrust) > THRUST_MARGIN * max_thrust(vehicle):
        return CommandRefusal.THRUST
    largest = scale(TORQUE_MARGIN, largest_torque(vehicle))
    if abs(torque.x) > largest.x or abs(torque.y) > largest.y or abs(torque.z) > largest.z:
        return CommandRefusal.TORQUE
    return CommandRefusal.ACCEPTED


def sample_refusal(
    limits: StateLimits,
    sample: StateSample,
    last: BodyState,
    last_step: int,
    turned: BodyState,
    turned_step: int,
    now: int,
    period: int,
    frozen: bool,
) -> StateRefusal:
    """Return why ``sample`` is refused at plant step ``now``, or ACCEPTED; ``period`` in ns.

    ``last`` is the sample accepted at ``last_step``; before the first one ``last_step`` is negative, and nothing can
    have jumped. ``turned`` has the attitude that is expected: ``last``, or that as measured body rates have turned it
    up to ``turned_step``. ``frozen``: it repeats ``last`` although a live vehicle would show a change
    (``quad_guard.state``).
    """
    state = sample.state
    if not is_flyable(state):
        return StateRefusal.NOT_FINITE
    if sample.step <= last_step:
        return StateRefusal.NOT_NEWER
    if (sample.step - now) * period / 1e9 > limits.ahead:
        return StateRefusal.AHEAD
    if last_step < 0:
        return StateRefusal.ACCEPTED
    if frozen:
        return StateRefusal.FROZEN
    gap = (sample.step - last_step) * period / 1e9
    if position_change(last, state, gap) > limits.position_jump:
        return StateRefusal.POSITION_JUMP
    if is_surely_within(turned.q_wb, state.q_wb, limits.attitude_jump):
        return StateRefusal.ACCEPTED
    gap = (sample.step - turned_step) * period / 1e9
    if attitude_change(turned.q_wb, state.q_wb) > limits.attitude_jump + gap * norm(turned.omega_b):
        return StateRefusal.ATTITUDE_JUMP
    return StateRefusal.ACCEPTED


def is_on_ground(rule: ContactRule, vehicle: Vehicle, state: BodyState, height: float, thrust: float) -> bool:
    """Return whether ``state`` is at rest, ``height`` m above the ground, and ``thrust`` in N too low to fly."""
    return (
        height <= rule.stop_height
        and norm(state.v_w) < rule.speed
        and thrust < rule.thrust * vehicle.mass * vehicle.gravity
    )


def position_change(last: BodyState, state: VehicleState, gap: float) -> float:
    """Return the distance in m of ``state`` from where ``last`` led at its velocity ``gap`` s later."""
    x = state.p_w.x - last.p_w.x - gap * last.v_w.x
    y = state.p_w.y - last.p_w.y - gap * last.v_w.y
    z = state.p_w.z - last.p_w.z - gap * last.v_w.z
    return math.sqrt(x * x + y * y + z * z)


def attitude_change(last: Quat, q: Quat) -> float:
    """Return the angle in rad, 0 to pi, between two attitudes; q and -q are the same one."""
    cosine = half_cosine(last, q)
    return 2.0 * math.acos(cosine) if cosine < 1.0 else 0.0


def is_surely_within(last: Quat, q: Quat, angle: float) -> bool:
    """Return whether ``attitude_change`` surely is at most ``angle`` in rad: quicker than to ask it.

    (2 acos c)^2 <= 2 pi^2 (1 - c) for c from 0 to 1, and 2 pi^2 < 20 by more than all rounding.
    """
    return 20.0 * (1.0 - half_cosine(last, q)) <= angle * angle


def half_cosine(last: Quat, q: Quat) -> float:
    """Return the cosine, 0 to 1, of half the angle between two attitudes."""
    return abs(last.x * q.x + last.y * q.y + last.z * q.z + last.w * q.w)


OFF = 1e6  # m/s that are no limit of the speed
LANDING_SPEED, BRAKING = 1.0, 5.0
"""Within a limit of the speed nothing sinks faster, in m/s, than what these m/s^2 brake before the ground."""


def broken_limit(limits: StepLimits, home: Vec3, ground_z: float, p_w: Vec3, v_w: Vec3, q_wb: Quat) -> GuardReason:
    """Return which limit a vehicle is beyond; GOOD within all. m, m/s.

    ``home``: where it took off, ``ground_z``: the height of the ground there.
    """
    x, y, z = abs(p_w.x - home.x), abs(p_w.y - home.y), p_w.z - ground_z
    if x > limits.box or y > limits.box or z > limits.box:
        return GuardReason.STEP_BOX
    if v_w.x * v_w.x + v_w.y * v_w.y + v_w.z * v_w.z > limits.speed * limits.speed:
        return GuardReason.STEP_SPEED
    if limits.speed < OFF and v_w.z < -LANDING_SPEED and v_w.z * v_w.z > 2.0 * BRAKING * z:
        return GuardReason.STEP_SPEED
    if limits.tilt < math.pi and body_z(q_wb).z < math.cos(limits.tilt):
        return GuardReason.STEP_TILT
    return GuardReason.GOOD


def within_thrust_range(parameters: GuardParameters, vehicle: Vehicle, thrust: float, height: float) -> float:
    """Return the thrust in N that may reach the rotors, ``height`` m above the ground; near it the vehicle may land."""
    limits, weight = parameters.step, vehicle.mass * vehicle.gravity
    least = limits.least_thrust * weight
    if height <= parameters.contact.stop_height and least > 0.0:
        least = 0.0
    return clamp(thrust, least, limits.most_thrust * weight)
