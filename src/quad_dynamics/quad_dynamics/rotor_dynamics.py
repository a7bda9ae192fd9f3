"""Rotors that take time: speeds that follow their command, and what they do to the body at one instant."""

import math
from typing import NamedTuple

from quad_core.types import ALL_ROTORS, Actuation, Conditions, Rotors
from quad_core.vehicle import LAYOUT_X, Vehicle
from quad_dynamics.allocation import smaller
from quad_dynamics.newton_euler import Quadruple, Triple
from quad_dynamics.parameters import Effectiveness
from quad_dynamics.rotors import DIAGONAL, rotor_limit, wrench_from_rotors

LONGEST_RATIO = 700.0
"""exp(-700) is the least that cannot underflow."""


class Push(NamedTuple):
    """What the rotors do at one instant: thrust N, torque N m (reaction to their acceleration included), body frame.

    ``spin`` is their angular momentum about body z in N m s, ``drag`` the coefficient of their drag in N s/m.
    """

    thrust: float
    torque_b: Triple
    spin: float
    drag: float


def most_thrust(vehicle: Vehicle, conditions: Conditions) -> float:
    """Return the largest thrust in N of one rotor that the battery allows."""
    return conditions.thrust_limit * rotor_limit(vehicle)


def is_lagging(vehicle: Vehicle) -> bool:
    """Return whether the rotors take time to follow."""
    return vehicle.rotor_time_constant > 0.0


def share_left(vehicle: Vehicle, time: float) -> float:
    """Return exp(-time / constant), the share of a difference between speed and command left after ``time`` s."""
    return math.exp(-smaller(time / vehicle.rotor_time_constant, LONGEST_RATIO))


def follow(speeds: Quadruple, wanted: Quadruple, left: float) -> Quadruple:
    """Return rotor speeds in rad/s when the share ``left`` of the way is left: exactly R' = (wanted - R) / constant."""
    a, b, c, d = wanted
    e, f, g, h = speeds
    return a + (e - a) * left, b + (f - b) * left, c + (g - c) * left, d + (h - d) * left


def thrusts_of(vehicle: Vehicle, speeds: Quadruple) -> Quadruple:
    """Return the thrust in N of each rotor at ``speeds`` rad/s (Eq. 3)."""
    k = vehicle.lift_coefficient
    a, b, c, d = speeds
    return k * a * a, k * b * b, k * c * c, k * d * d


def each(rotors: Rotors) -> Quadruple:
    """Return the four numbers as a plain tuple: inside a step NamedTuples would cost CPython a tenth of it."""
    return rotors.r1, rotors.r2, rotors.r3, rotors.r4


def true_push(
    vehicle: Vehicle, factor: Effectiveness, working: Rotors, thrusts: Quadruple, speeds: Quadruple, wanted: Quadruple
) -> Push:
    """Return what rotors with nominal ``thrusts`` N at ``speeds`` rad/s truly do (F_A + dF_A, tau_A + dtau_A, Eq. 10).

    ``working`` is true over nominal thrust of each rotor, ``wanted`` the speeds they are on the way to. Eqs. 3 and 8
    are those of ``rotors.wrench_from_rotors`` written out; a test holds both to the same bits.
    """
    f1, f2, f3, f4 = thrusts
    if working != ALL_ROTORS:
        f1, f2, f3, f4 = working.r1 * f1, working.r2 * f2, working.r3 * f3, working.r4 * f4
    left, rear, arm = f4 - f2, f1 - f3, vehicle.arm_length
    if vehicle.layout == LAYOUT_X:
        arm = DIAGONAL * arm
        left, rear = left - rear, left + rear
    yaw = factor.yaw * (vehicle.torque_coefficient / vehicle.lift_coefficient * (f1 - f2 + f3 - f4))
    spin, drag = 0.0, 0.0
    if vehicle.rotor_inertia > 0.0:
        # rotors 1 and 3 turn clockwise seen from above: momentum along -z
        spin = vehicle.rotor_inertia * (speeds[1] - speeds[0] + speeds[3] - speeds[2])
        if is_lagging(vehicle):
            goal = vehicle.rotor_inertia * (wanted[1] - wanted[0] + wanted[3] - wanted[2])
            yaw -= (goal - spin) / vehicle.rotor_time_constant
    if vehicle.rotor_drag_coefficient > 0.0:
        drag = vehicle.rotor_drag_coefficient * (speeds[0] + speeds[1] + speeds[2] + speeds[3])
    return Push(
        factor.thrust * (f1 + f2 + f3 + f4), (factor.roll * (arm * left), factor.pitch * (arm * rear), yaw), spin, drag
    )


def reported(vehicle: Vehicle, allocated: Actuation, speeds: Quadruple, thrusts: Quadruple) -> Actuation:
    """Return ``allocated`` with what lagging rotors have reached: speeds rad/s, thrusts N and wrench; flags stay.

    A flag says that the command is out of reach, not that the rotors are still on their way to it.
    """
    lifts = Rotors(thrusts[0], thrusts[1], thrusts[2], thrusts[3])
    made = wrench_from_rotors(vehicle, lifts)
    return Actuation(
        Rotors(speeds[0], speeds[1], speeds[2], speeds[3]),
        lifts,
        made.thrust,
        made.torque_b,
        allocated.thrust_high,
        allocated.thrust_low,
        allocated.roll_limited,
        allocated.pitch_limited,
        allocated.yaw_limited,
    )
