"""Rotors that take time: speeds that follow their command, and what they do to the body at one instant."""

import math
from typing import NamedTuple

from quad_core.types import Actuation, Conditions, Rotors
from quad_core.vehicle import Vehicle
from quad_dynamics.allocation import smaller
from quad_dynamics.newton_euler import Triple
from quad_dynamics.parameters import Effectiveness
from quad_dynamics.rotors import rotor_limit, rotor_thrust, wrench_from_rotors

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


def follow(vehicle: Vehicle, speeds: Rotors, wanted: Rotors, time: float) -> Rotors:
    """Return rotor speeds in rad/s ``time`` s after ``speeds``: the exact solution of R' = (wanted - R) / constant."""
    if not is_lagging(vehicle):
        return wanted
    ratio = smaller(time / vehicle.rotor_time_constant, LONGEST_RATIO)
    left = math.exp(-ratio)
    return Rotors(
        wanted.r1 + (speeds.r1 - wanted.r1) * left,
        wanted.r2 + (speeds.r2 - wanted.r2) * left,
        wanted.r3 + (speeds.r3 - wanted.r3) * left,
        wanted.r4 + (speeds.r4 - wanted.r4) * left,
    )


def thrusts_of(vehicle: Vehicle, speeds: Rotors) -> Rotors:
    """Return the thrust in N of each rotor at ``speeds`` rad/s (Eq. 3)."""
    return Rotors(
        rotor_thrust(vehicle, speeds.r1),
        rotor_thrust(vehicle, speeds.r2),
        rotor_thrust(vehicle, speeds.r3),
        rotor_thrust(vehicle, speeds.r4),
    )


def true_push(
    vehicle: Vehicle, factor: Effectiveness, working: Rotors, thrusts: Rotors, speeds: Rotors, wanted: Rotors
) -> Push:
    """Return what rotors with nominal ``thrusts`` N at ``speeds`` rad/s truly do (F_A + dF_A, tau_A + dtau_A, Eq. 10).

    ``working`` is true over nominal thrust of each rotor, ``wanted`` the speeds they are on the way to.
    """
    true = Rotors(working.r1 * thrusts.r1, working.r2 * thrusts.r2, working.r3 * thrusts.r3, working.r4 * thrusts.r4)
    wrench = wrench_from_rotors(vehicle, true)
    torque = wrench.torque_b
    yaw = factor.yaw * torque.z
    spin, drag = 0.0, 0.0
    if vehicle.rotor_inertia > 0.0:
        # rotors 1 and 3 turn clockwise seen from above: momentum along -z
        spin = vehicle.rotor_inertia * (speeds.r2 - speeds.r1 + speeds.r4 - speeds.r3)
        if is_lagging(vehicle):
            goal = vehicle.rotor_inertia * (wanted.r2 - wanted.r1 + wanted.r4 - wanted.r3)
            yaw -= (goal - spin) / vehicle.rotor_time_constant
    if vehicle.rotor_drag_coefficient > 0.0:
        drag = vehicle.rotor_drag_coefficient * (speeds.r1 + speeds.r2 + speeds.r3 + speeds.r4)
    return Push(factor.thrust * wrench.thrust, (factor.roll * torque.x, factor.pitch * torque.y, yaw), spin, drag)


def reported(vehicle: Vehicle, allocated: Actuation, speeds: Rotors) -> Actuation:
    """Return ``allocated`` with what lagging rotors have reached: speeds, thrusts and wrench; flags stay.

    A flag says that the command is out of reach, not that the rotors are still on their way to it.
    """
    thrusts = thrusts_of(vehicle, speeds)
    made = wrench_from_rotors(vehicle, thrusts)
    return Actuation(
        speeds,
        thrusts,
        made.thrust,
        made.torque_b,
        allocated.thrust_high,
        allocated.thrust_low,
        allocated.roll_limited,
        allocated.pitch_limited,
        allocated.yaw_limited,
    )
