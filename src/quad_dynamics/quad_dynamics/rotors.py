"""Rotors: thrust and torque of each, and the wrench that four of them make (Eqs. 3 and 8).

Body frame forward-left-up. Layout ``plus`` (the paper's): 1 rear, 2 right, 3 front, 4 left. Layout ``x`` is
the same turned by 45 degrees to the left: 1 rear right, 2 front right, 3 front left, 4 rear left. In both,
rotors 1 and 3 spin clockwise seen from above and so push the body to +yaw; 2 and 4 push it to -yaw.
"""

import math

from quad_core.types import Rotors, Vec3, Wrench
from quad_core.vehicle import LAYOUT_X, Vehicle, max_thrust

DIAGONAL = math.sqrt(0.5)


def rotor_limit(vehicle: Vehicle) -> float:
    """Return the largest thrust of one rotor in N: a quarter of the vehicle's."""
    return 0.25 * max_thrust(vehicle)


def rotor_thrust(vehicle: Vehicle, speed: float) -> float:
    """Return F_i = k_L R_i^2 in N of a rotor at ``speed`` rad/s (Eq. 3)."""
    return vehicle.lift_coefficient * speed * speed


def rotor_speed(vehicle: Vehicle, thrust: float) -> float:
    """Return the speed R_i in rad/s at which a rotor gives ``thrust`` N >= 0 (inverse of Eq. 3)."""
    return math.sqrt(thrust / vehicle.lift_coefficient)


def yaw_arm(vehicle: Vehicle) -> float:
    """Return k_M / k_L in m: the yaw torque that a rotor makes per newton of its thrust (Eqs. 3, 8)."""
    return vehicle.torque_coefficient / vehicle.lift_coefficient


def wrench_from_rotors(vehicle: Vehicle, thrusts: Rotors) -> Wrench:
    """Return collective thrust in N and physical body torque in N m of four rotor thrusts in N (Eqs. 3, 8).

    Plus layout: (d U_phi, d U_theta, U_psi) with U_phi = F_4 - F_2 and U_theta = F_1 - F_3 of Eq. 8.
    """
    left_over_right = thrusts.r4 - thrusts.r2
    rear_over_front = thrusts.r1 - thrusts.r3
    if vehicle.layout == LAYOUT_X:
        arm = DIAGONAL * vehicle.arm_length
        roll = arm * (left_over_right - rear_over_front)
        pitch = arm * (left_over_right + rear_over_front)
    else:
        roll = vehicle.arm_length * left_over_right
        pitch = vehicle.arm_length * rear_over_front
    yaw = yaw_arm(vehicle) * (thrusts.r1 - thrusts.r2 + thrusts.r3 - thrusts.r4)
    return Wrench(thrusts.r1 + thrusts.r2 + thrusts.r3 + thrusts.r4, Vec3(roll, pitch, yaw))
