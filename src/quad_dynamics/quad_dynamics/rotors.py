"""Rotors: what each does (Eqs. 3 and 8), the allocation of a wrench to four of them, and their lag.

::

    F_i = k_L R_i^2        F_T = F_1 + F_2 + F_3 + F_4        R' = (R_command - R) / time constant
    tau = (d (F_4 - F_2), d (F_1 - F_3), k_M/k_L (F_1 - F_2 + F_3 - F_4))                   (layout plus)

Body frame forward-left-up. Layout ``plus`` (the paper's): 1 rear, 2 right, 3 front, 4 left. Layout ``x`` is the same
turned by 45 degrees to the left: 1 rear right, 2 front right, 3 front left, 4 rear left. In both, rotors 1 and 3 spin
clockwise seen from above and so turn the body to +yaw; 2 and 4 turn it to -yaw.

Allocation inverts Eqs. 3 and 8 within the rotors' limits, exactly and without search. Two opposite rotors form a pair.
A pair's difference makes roll and pitch, the sum of both pairs makes thrust, the difference of their sums makes yaw. A
pair with difference D can have any sum in [abs(D), 2 f - abs(D)], f being the limit of one rotor, so each step below is
an interval. What cannot be reached gives way in this order: yaw first (down to none, never over or against the
command), then thrust (to the nearest at which the roll and pitch torque can be kept), last roll and pitch (scaled
together, so that the axis of the torque stays). So the direction of thrust is steered as long as any rotor can do it.
"""

import math
from typing import NamedTuple

from quad_core.geometry import clamp
from quad_core.types import Actuation, Conditions, Rotors, Vec3, Wrench
from quad_core.vehicle import Layout, Vehicle, max_thrust
from quad_dynamics.parameters import Effectiveness, PlantParameters

DIAGONAL = math.sqrt(0.5)
LARGEST_TORQUE = 1e12
FLAG_TOLERANCE = 1e-9
LONGEST_RATIO = 700.0
"""exp(-700) is the least that cannot underflow."""


def rotor_limit(vehicle: Vehicle) -> float:
    """Return the largest thrust of one rotor in N: a quarter of the vehicle's."""
    return 0.25 * max_thrust(vehicle)


def max_rotor_thrust(vehicle: Vehicle, conditions: Conditions) -> float:
    """Return the largest thrust in N of one rotor that the battery allows."""
    return conditions.thrust_limit * rotor_limit(vehicle)


def rotor_thrust(vehicle: Vehicle, speed: float) -> float:
    """Return F_i = k_L R_i^2 in N of a rotor at ``speed`` rad/s (Eq. 3)."""
    return vehicle.lift_coefficient * speed * speed


def rotor_speed(vehicle: Vehicle, thrust: float) -> float:
    """Return the speed R_i in rad/s at which a rotor gives ``thrust`` N >= 0 (inverse of Eq. 3)."""
    return math.sqrt(thrust / vehicle.lift_coefficient)


def rotor_thrusts(vehicle: Vehicle, speeds: Rotors) -> Rotors:
    """Return the thrust in N of each rotor at ``speeds`` rad/s (Eq. 3)."""
    return Rotors(
        rotor_thrust(vehicle, speeds.r1),
        rotor_thrust(vehicle, speeds.r2),
        rotor_thrust(vehicle, speeds.r3),
        rotor_thrust(vehicle, speeds.r4),
    )


def yaw_arm(vehicle: Vehicle) -> float:
    """Return k_M / k_L in m: the yaw torque that a rotor makes per newton of its thrust (Eqs. 3, 8)."""
    return vehicle.torque_coefficient / vehicle.lift_coefficient


def wrench_from_rotors(vehicle: Vehicle, thrusts: Rotors) -> Wrench:
    """Return collective thrust in N and physical body torque in N m of four rotor thrusts in N (Eqs. 3, 8).

    Plus layout: (d U_phi, d U_theta, U_psi) with U_phi = F_4 - F_2 and U_theta = F_1 - F_3 of Eq. 8.
    """
    left_over_right = thrusts.r4 - thrusts.r2
    rear_over_front = thrusts.r1 - thrusts.r3
    if vehicle.layout == Layout.X:
        arm = DIAGONAL * vehicle.arm_length
        roll = arm * (left_over_right - rear_over_front)
        pitch = arm * (left_over_right + rear_over_front)
    else:
        roll = vehicle.arm_length * left_over_right
        pitch = vehicle.arm_length * rear_over_front
    yaw = yaw_arm(vehicle) * (thrusts.r1 - thrusts.r2 + thrusts.r3 - thrusts.r4)
    return Wrench(thrusts.r1 + thrusts.r2 + thrusts.r3 + thrusts.r4, Vec3(roll, pitch, yaw))


class RotorWrench(NamedTuple):
    """What the rotors do to the body at one instant: thrust N, torque N m (reaction to their acceleration included).

    ``spin`` is their angular momentum about body z in N m s, ``drag`` the coefficient of their drag in N s/m.
    """

    thrust: float
    torque_b: Vec3
    spin: float
    drag: float


def rotor_wrench(
    vehicle: Vehicle,
    factor: Effectiveness,
    working: Rotors,
    thrusts: Rotors,
    speeds: Rotors,
    commanded: Rotors,
    lag: float,
) -> RotorWrench:
    """Return what rotors with nominal ``thrusts`` N truly do at ``speeds`` rad/s (F_A + dF_A, tau_A + dtau_A, Eq. 10).

    ``working`` is true over nominal thrust of each rotor; ``commanded`` rad/s are the speeds that they are on the way
    to, with the time constant ``lag`` s.
    """
    true_thrusts = Rotors(
        working.r1 * thrusts.r1, working.r2 * thrusts.r2, working.r3 * thrusts.r3, working.r4 * thrusts.r4
    )
    made = wrench_from_rotors(vehicle, true_thrusts)
    yaw = factor.yaw * made.torque_b.z
    spin, drag = 0.0, 0.0
    if vehicle.rotor_inertia > 0.0:
        spin = angular_momentum(vehicle, speeds)
        if lag > 0.0:
            yaw -= (angular_momentum(vehicle, commanded) - spin) / lag
    if vehicle.rotor_drag_coefficient > 0.0:
        drag = vehicle.rotor_drag_coefficient * (speeds.r1 + speeds.r2 + speeds.r3 + speeds.r4)
    torque = Vec3(factor.roll * made.torque_b.x, factor.pitch * made.torque_b.y, yaw)
    return RotorWrench(factor.thrust * made.thrust, torque, spin, drag)


def angular_momentum(vehicle: Vehicle, speeds: Rotors) -> float:
    """Return the rotors' angular momentum about body z in N m s; rotors 1 and 3 turn clockwise, so along -z."""
    return vehicle.rotor_inertia * (speeds.r2 - speeds.r1 + speeds.r4 - speeds.r3)


def rotor_lag(parameters: PlantParameters, vehicle: Vehicle) -> float:
    """Return the true time constant in s with which the rotors follow their command; 0: at once."""
    return vehicle.rotor_time_constant + parameters.lag_error


def decay(lag: float, time: float) -> float:
    """Return exp(-time / lag): what is left after ``time`` s of a difference between speed and command."""
    return math.exp(-min(LONGEST_RATIO, time / lag))


def known_speeds(
    parameters: PlantParameters, vehicle: Vehicle, before: Rotors, commanded: Rotors, true: Rotors, dt: float
) -> Rotors:
    """Return the speeds in rad/s that `actuation` tells after a step of ``dt`` s; ``before``: those of the last step.

    The ``true`` ones where the lag is as nominal: measured or modelled, they are the same then. Else those of rotors
    with the nominal lag, which is what a vehicle without speed sensors assumes.
    """
    if parameters.lag_error == 0.0:
        return true
    if vehicle.rotor_time_constant <= 0.0:
        return commanded
    return lagged(before, commanded, decay(vehicle.rotor_time_constant, dt))


def lagged(speeds: Rotors, commanded: Rotors, factor: float) -> Rotors:
    """Return rotor speeds in rad/s once their distance from ``commanded`` has shrunk by ``factor``, a ``decay``.

    Exact for R' = (commanded - R) / constant.
    """
    return Rotors(
        commanded.r1 + (speeds.r1 - commanded.r1) * factor,
        commanded.r2 + (speeds.r2 - commanded.r2) * factor,
        commanded.r3 + (speeds.r3 - commanded.r3) * factor,
        commanded.r4 + (speeds.r4 - commanded.r4) * factor,
    )


def reached(vehicle: Vehicle, allocated: Actuation, speeds: Rotors) -> Actuation:
    """Return ``allocated`` with the ``speeds`` rad/s that lagging rotors have reached, thrusts and wrench; flags stay.

    A flag says that the command is out of reach, not that the rotors are still on their way to it.
    """
    thrusts = rotor_thrusts(vehicle, speeds)
    made = wrench_from_rotors(vehicle, thrusts)
    return Actuation(
        rotor_speed=speeds,
        rotor_thrust=thrusts,
        thrust=made.thrust,
        torque_b=made.torque_b,
        thrust_high=allocated.thrust_high,
        thrust_low=allocated.thrust_low,
        roll_limited=allocated.roll_limited,
        pitch_limited=allocated.pitch_limited,
        yaw_limited=allocated.yaw_limited,
    )


def pair_differences(vehicle: Vehicle, roll: float, pitch: float) -> tuple[float, float]:
    """Return (F_4 - F_2, F_1 - F_3) in N that make ``roll`` and ``pitch`` torque in N m (inverse of Eq. 8)."""
    if vehicle.layout == Layout.X:
        scale = DIAGONAL / vehicle.arm_length
        return scale * (pitch + roll), scale * (pitch - roll)
    return roll / vehicle.arm_length, pitch / vehicle.arm_length


def pair_sums(thrust: float, yaw_force: float, width_13: float, width_24: float, limit: float) -> tuple[float, float]:
    """Return (F_1 + F_3, F_2 + F_4) in N nearest to the command: thrust first, then yaw.

    ``yaw_force`` is the commanded (F_1 + F_3) - (F_2 + F_4); ``width_13`` and ``width_24`` are the sizes of the pairs'
    differences, at most ``limit``, the largest thrust of one rotor; all in N.
    """
    yaw_low = clamp(yaw_force, -2.0 * limit, 0.0)
    yaw_high = clamp(yaw_force, 0.0, 2.0 * limit)
    top_13, top_24 = 4.0 * limit - 2.0 * width_13, 4.0 * limit - 2.0 * width_24
    # the yaw, between none and the command, that leaves the most margin for thrust
    yaw_down = clamp(width_13 - width_24, yaw_low, yaw_high)
    yaw_up = clamp(width_24 - width_13, yaw_low, yaw_high)
    lowest = max(2.0 * width_24 + yaw_down, 2.0 * width_13 - yaw_down)
    highest = min(top_24 + yaw_up, top_13 - yaw_up)
    total = clamp(thrust, lowest, highest)
    low = max(total - top_24, 2.0 * width_13 - total)
    high = min(total - 2.0 * width_24, top_13 - total)
    difference = clamp(clamp(yaw_force, yaw_low, yaw_high), low, high)
    return 0.5 * (total + difference), 0.5 * (total - difference)


def nearest(vehicle: Vehicle, thrust: float, torque: Vec3, limit: float) -> tuple[float, float, float, float]:
    """Return the four thrusts in N within 0..``limit`` for a ``thrust`` N and ``torque`` N m that are out of reach."""
    roll = clamp(torque.x, -LARGEST_TORQUE, LARGEST_TORQUE)
    pitch = clamp(torque.y, -LARGEST_TORQUE, LARGEST_TORQUE)
    d42, d13 = pair_differences(vehicle, roll, pitch)
    widest = max(abs(d13), abs(d42))
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


def allocate_within(vehicle: Vehicle, wrench: Wrench, max_each: float) -> Actuation:
    """Return what four rotors make of ``wrench`` (any finite N and N m): Eqs. 3, 8 and flags.

    Each rotor stays between its thrust at the vehicle's least speed and ``max_each`` N. With that least thrust taken
    off every rotor the task is the one with limits 0 and ``max_each`` - least. The wrench in the result is that of the
    nominal rotors: errors of effectiveness are not known on board. A flag is set where the achieved value misses the
    command by more than 1e-9 of the rotors' range.
    """
    least = min(max_each, rotor_thrust(vehicle, vehicle.rotor_speed_min))
    limit = max_each - least
    torque = wrench.torque_b
    yaw_lever = yaw_arm(vehicle)
    thrust, yaw_force = wrench.thrust - 4.0 * least, torque.z / yaw_lever
    d42, d13 = pair_differences(vehicle, torque.x, torque.y)
    s13, s24 = 0.5 * (thrust + yaw_force), 0.5 * (thrust - yaw_force)
    f1, f2, f3, f4 = 0.5 * (s13 + d13), 0.5 * (s24 - d42), 0.5 * (s13 - d13), 0.5 * (s24 + d42)
    if not (0.0 <= f1 <= limit and 0.0 <= f2 <= limit and 0.0 <= f3 <= limit and 0.0 <= f4 <= limit):
        f1, f2, f3, f4 = nearest(vehicle, thrust, torque, limit)
    thrusts = Rotors(least + f1, least + f2, least + f3, least + f4)
    speeds = Rotors(
        rotor_speed(vehicle, thrusts.r1),
        rotor_speed(vehicle, thrusts.r2),
        rotor_speed(vehicle, thrusts.r3),
        rotor_speed(vehicle, thrusts.r4),
    )
    achieved = wrench_from_rotors(vehicle, thrusts)
    slack = FLAG_TOLERANCE * max_each
    tilt_slack = slack * vehicle.arm_length
    return Actuation(
        speeds,
        thrusts,
        achieved.thrust,
        achieved.torque_b,
        achieved.thrust < wrench.thrust - slack,
        achieved.thrust > wrench.thrust + slack,
        abs(achieved.torque_b.x - torque.x) > tilt_slack,
        abs(achieved.torque_b.y - torque.y) > tilt_slack,
        abs(achieved.torque_b.z - torque.z) > slack * yaw_lever,
    )
