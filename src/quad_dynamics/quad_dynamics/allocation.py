"""Wrench to four rotor thrusts within their limits, exact and without search (inverse of Eqs. 3 and 8).

Two opposite rotors form a pair. A pair's difference makes roll and pitch, the sum of both pairs makes thrust, the
difference of their sums makes yaw. A pair with difference D can have any sum in [abs(D), 2 f - abs(D)], f being the
limit of one rotor, so each step below is an interval.

What cannot be reached gives way in this order: yaw first (down to none, never over or against what was asked), then
thrust (to the nearest at which the roll and pitch torque can be held), last roll and pitch (scaled together, so that
the axis of the torque stays). So the direction of thrust is steered as long as any rotor can do it.
"""

import math

from quad_core.bounds import clamp
from quad_core.types import Actuation, Rotors, Vec3, Wrench
from quad_core.vehicle import LAYOUT_X, Vehicle
from quad_dynamics.rotors import DIAGONAL, rotor_limit, rotor_thrust, wrench_from_rotors, yaw_arm

LARGEST_TORQUE = 1e12
FLAG_TOLERANCE = 1e-9


def pair_differences(vehicle: Vehicle, roll: float, pitch: float) -> tuple[float, float]:
    """Return (F_4 - F_2, F_1 - F_3) in N that make ``roll`` and ``pitch`` torque in N m (inverse of Eq. 8)."""
    if vehicle.layout == LAYOUT_X:
        scale = DIAGONAL / vehicle.arm_length
        return scale * (pitch + roll), scale * (pitch - roll)
    return roll / vehicle.arm_length, pitch / vehicle.arm_length


def pair_sums(thrust: float, yaw_force: float, width_13: float, width_24: float, limit: float) -> tuple[float, float]:
    """Return (F_1 + F_3, F_2 + F_4) in N nearest to what is asked: thrust first, then yaw.

    ``yaw_force`` is (F_1 + F_3) - (F_2 + F_4) as asked; ``width_13`` and ``width_24`` are the sizes of the pairs'
    differences, at most ``limit``, the largest thrust of one rotor; all in N.
    """
    yaw_low = clamp(yaw_force, -2.0 * limit, 0.0)
    yaw_high = clamp(yaw_force, 0.0, 2.0 * limit)
    top_13, top_24 = 4.0 * limit - 2.0 * width_13, 4.0 * limit - 2.0 * width_24
    # the yaw, none to what was asked, that leaves the most room to thrust downward and upward
    yaw_down = clamp(width_13 - width_24, yaw_low, yaw_high)
    yaw_up = clamp(width_24 - width_13, yaw_low, yaw_high)
    least = larger(2.0 * width_13 - yaw_down, 2.0 * width_24 + yaw_down)
    most = smaller(top_13 - yaw_up, top_24 + yaw_up)
    total = clamp(thrust, least, most)
    low = larger(2.0 * width_13 - total, total - top_24)
    high = smaller(top_13 - total, total - 2.0 * width_24)
    difference = clamp(clamp(yaw_force, yaw_low, yaw_high), low, high)
    return 0.5 * (total + difference), 0.5 * (total - difference)


def larger(a: float, b: float) -> float:
    """Return the larger of two numbers."""
    return a if a > b else b


def smaller(a: float, b: float) -> float:
    """Return the smaller of two numbers."""
    return a if a < b else b


def nearest(vehicle: Vehicle, thrust: float, torque: Vec3, limit: float) -> tuple[float, float, float, float]:
    """Return the four thrusts in N within 0..``limit`` for a ``thrust`` N and ``torque`` N m that are out of reach."""
    roll = clamp(torque.x, -LARGEST_TORQUE, LARGEST_TORQUE)
    pitch = clamp(torque.y, -LARGEST_TORQUE, LARGEST_TORQUE)
    d42, d13 = pair_differences(vehicle, roll, pitch)
    widest = larger(abs(d42), abs(d13))
    if widest > limit:
        d42, d13 = d42 * (limit / widest), d13 * (limit / widest)
    s13, s24 = pair_sums(thrust, torque.z / yaw_arm(vehicle), abs(d13), abs(d42), limit)
    # rounding alone can step over a limit by an ulp
    return (
        clamp(0.5 * (s13 + d13), 0.0, limit),
        clamp(0.5 * (s24 - d42), 0.0, limit),
        clamp(0.5 * (s13 - d13), 0.0, limit),
        clamp(0.5 * (s24 + d42), 0.0, limit),
    )


def allocate(vehicle: Vehicle, wrench: Wrench) -> Actuation:
    """Return what four ideal rotors with a full battery make of ``wrench``; see ``allocate_within``."""
    return allocate_within(vehicle, wrench, rotor_limit(vehicle))


def allocate_within(vehicle: Vehicle, wrench: Wrench, most: float) -> Actuation:
    """Return what four rotors make of ``wrench`` (any finite N and N m): Eqs. 3, 8 and flags.

    Each rotor is held between its thrust at the vehicle's least speed and ``most`` N. With that least thrust taken off
    every rotor the task is the one with limits 0 and ``most`` - least. The wrench in the result is that of the nominal
    rotors: errors of effectiveness are not known on board. A flag is set where the achieved value misses the asked one
    by more than 1e-9 of the rotors' range.
    """
    least = smaller(rotor_thrust(vehicle, vehicle.rotor_speed_min), most)
    limit = most - least
    asked = wrench.torque_b
    yaw_lever = yaw_arm(vehicle)
    thrust, yaw_force = wrench.thrust - 4.0 * least, asked.z / yaw_lever
    d42, d13 = pair_differences(vehicle, asked.x, asked.y)
    s13, s24 = 0.5 * (thrust + yaw_force), 0.5 * (thrust - yaw_force)
    f1, f2, f3, f4 = 0.5 * (s13 + d13), 0.5 * (s24 - d42), 0.5 * (s13 - d13), 0.5 * (s24 + d42)
    if not (0.0 <= f1 <= limit and 0.0 <= f2 <= limit and 0.0 <= f3 <= limit and 0.0 <= f4 <= limit):
        f1, f2, f3, f4 = nearest(vehicle, thrust, asked, limit)
    thrusts = Rotors(least + f1, least + f2, least + f3, least + f4)
    k = vehicle.lift_coefficient
    speeds = Rotors(
        math.sqrt(thrusts.r1 / k), math.sqrt(thrusts.r2 / k), math.sqrt(thrusts.r3 / k), math.sqrt(thrusts.r4 / k)
    )
    achieved = wrench_from_rotors(vehicle, thrusts)
    slack = FLAG_TOLERANCE * most
    tilt_slack = slack * vehicle.arm_length
    return Actuation(
        speeds,
        thrusts,
        achieved.thrust,
        achieved.torque_b,
        achieved.thrust < wrench.thrust - slack,
        achieved.thrust > wrench.thrust + slack,
        abs(achieved.torque_b.x - asked.x) > tilt_slack,
        abs(achieved.torque_b.y - asked.y) > tilt_slack,
        abs(achieved.torque_b.z - asked.z) > slack * yaw_lever,
    )
