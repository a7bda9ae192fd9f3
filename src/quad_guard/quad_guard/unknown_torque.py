"""What the guard knows of its rotors: the torque that the model does not explain, and what torque costs in thrust.

    h' = tau - omega x J omega + d,   d = L (J omega - h)

h is the angular momentum that the commanded torque tau leads to, through the rotors' nominal lag; d is the unknown
torque behind a filter of bandwidth L (a momentum observer: De Luca and Mattone, 2003). A rotor that gives half of its
thrust shows in d, so does a load off the centre. The observer runs whoever flies, so that the backup law subtracts d
from its first step on. Without a fresh body rate and at the ground d stays as it is.

A weak rotor's d goes with the thrust, and its direction shows it: roll, pitch and yaw are those of less thrust at that
rotor alone (Eqs. 3, 8). Such a d is known with the thrust behind the same lag and filter, f_d: d f / f_d at a thrust f.

Four rotors cannot make a torque across body z without thrust: 2 max(|F_4 - F_2|, |F_1 - F_3|) at least (Eqs. 3, 8). An
allocation that keeps roll and pitch to the last raises thrust for it. A vehicle that cannot be levelled asks for all of
the torque, for ever, and climbs on it; so the backup law asks for no more torque than a thrust below the weight makes.
"""

from typing import NamedTuple

from quad_core.geometry import add, clamp, scale, subtract
from quad_core.types import Vec3, Wrench
from quad_core.vehicle import Layout, Vehicle, coupling_torque, max_thrust
from quad_guard.checks import DIAGONAL, largest_torque

BANDWIDTH = 15.0  # L in rad/s
TORQUE_THRUST = 0.7  # thrust, in weights, that roll and pitch torque may ask for; below 1, or the vehicle climbs
LIKENESS = 0.25  # share by which the parts of d may differ from a weak rotor's


class UnknownTorque(NamedTuple):
    """What the observer remembers, body frame: ``momentum`` h in N m s, ``made`` and ``torque`` d in N m.

    ``made`` and ``thrust`` (N) are commanded torque, as far as rotors can make it, and thrust behind their lag;
    ``filtered`` is the thrust behind the observer's filter too. ``of_thrust`` is f_d in N: that of the time of d.
    """

    momentum: Vec3 = Vec3()
    made: Vec3 = Vec3()
    torque: Vec3 = Vec3()
    thrust: float = 0.0
    filtered: float = 0.0
    of_thrust: float = 0.0


NO_UNKNOWN_TORQUE = UnknownTorque()  # the memory before the first step


def estimated(vehicle: Vehicle, memory: UnknownTorque, omega: Vec3, sees: bool) -> UnknownTorque:
    """Return the memory with d at new body rates ``omega`` rad/s; without ``sees``, d stays and h begins anew."""
    actual = Vec3(vehicle.inertia_xx * omega.x, vehicle.inertia_yy * omega.y, vehicle.inertia_zz * omega.z)
    if sees:
        found = within_rotors(vehicle, scale(BANDWIDTH, subtract(actual, memory.momentum)))
        return UnknownTorque(memory.momentum, memory.made, found, memory.thrust, memory.filtered, memory.filtered)
    momentum = subtract(actual, scale(1.0 / BANDWIDTH, memory.torque))
    return UnknownTorque(momentum, memory.made, memory.torque, memory.thrust, memory.filtered, memory.of_thrust)


def is_of_one_rotor(vehicle: Vehicle, torque: Vec3) -> bool:
    """Return whether less thrust at one rotor makes ``torque`` N m (Eqs. 3, 8)."""
    roll, pitch, arm = abs(torque.x), abs(torque.y), vehicle.arm_length
    if vehicle.layout == Layout.X:
        size, off, arm = 0.5 * (roll + pitch), 0.5 * abs(roll - pitch), DIAGONAL * arm
        turns_left = torque.x * torque.y > 0.0
    else:
        size, off = (roll, pitch) if roll > pitch else (pitch, roll)
        turns_left = roll > pitch
    yaw = size * vehicle.torque_coefficient / (vehicle.lift_coefficient * arm)
    return off <= LIKENESS * size and abs(torque.z - (yaw if turns_left else -yaw)) <= LIKENESS * yaw


def torque_at(vehicle: Vehicle, memory: UnknownTorque, thrust: float) -> Vec3:
    """Return d in N m at ``thrust`` N: a weak rotor's goes with the thrust."""
    if memory.of_thrust <= 0.0 or not is_of_one_rotor(vehicle, memory.torque):
        return memory.torque
    return scale(clamp(thrust / memory.of_thrust, 0.0, 2.0), memory.torque)


def advanced(vehicle: Vehicle, memory: UnknownTorque, omega: Vec3, flown: Wrench, dt: float) -> UnknownTorque:
    """Return the memory ``dt`` s later, under the commanded wrench ``flown`` at body rates ``omega`` rad/s."""
    share = dt / (vehicle.rotor_time_constant + dt)
    made = add(memory.made, scale(share, subtract(within_rotors(vehicle, flown.torque_b), memory.made)))
    thrust = memory.thrust + share * (flown.thrust - memory.thrust)
    filtered = memory.filtered + dt * BANDWIDTH * (thrust - memory.filtered)
    x, y, z = coupling_torque(vehicle, omega)
    momentum = add(memory.momentum, scale(dt, add(add(made, Vec3(x, y, z)), memory.torque)))
    return UnknownTorque(momentum, made, memory.torque, thrust, filtered, memory.of_thrust)


def within_rotors(vehicle: Vehicle, torque: Vec3) -> Vec3:
    """Return ``torque`` N m as far as four rotors can make it about each axis."""
    largest = largest_torque(vehicle)
    return Vec3(
        clamp(torque.x, -largest.x, largest.x),
        clamp(torque.y, -largest.y, largest.y),
        clamp(torque.z, -largest.z, largest.z),
    )


def thrust_for(vehicle: Vehicle, torque: Vec3) -> float:
    """Return the least thrust in N at which four rotors make the roll and pitch of ``torque`` N m (Eqs. 3, 8)."""
    roll, pitch = abs(torque.x), abs(torque.y)
    if vehicle.layout == Layout.X:
        return 2.0 * DIAGONAL * (roll + pitch) / vehicle.arm_length
    return 2.0 * (roll if roll > pitch else pitch) / vehicle.arm_length


def within_thrust(vehicle: Vehicle, thrust: float, torque: Vec3) -> Vec3:
    """Return ``torque`` N m with roll and pitch scaled together so that they cost no thrust beyond what is asked for.

    Asked for: ``thrust`` N, or TORQUE_THRUST of the weight if that is more; nor more than rotors can differ.
    """
    limit = 0.25 * max_thrust(vehicle)
    idle = vehicle.lift_coefficient * vehicle.rotor_speed_min * vehicle.rotor_speed_min
    least = TORQUE_THRUST * vehicle.mass * vehicle.gravity
    allowed = clamp((thrust if thrust > least else least) - 4.0 * idle, 0.0, 2.0 * (limit - idle))
    needed = thrust_for(vehicle, torque)
    if needed <= allowed:
        return torque
    share = allowed / needed
    return Vec3(share * torque.x, share * torque.y, torque.z)
