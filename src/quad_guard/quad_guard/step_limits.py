"""The limits of a first flight in steps: what a vehicle may do, and which thrust reaches its rotors.

The guard and the bridges to autopilots ask ``broken_limit`` at every state and ``within_thrust_range`` at every thrust.
"""

import math

from quad_core.enumerations import GuardReason
from quad_core.geometry import body_z, clamp
from quad_core.node_parameters import GuardParameters, StepLimits
from quad_core.types import Quat, Vec3
from quad_core.vehicle import Vehicle

OFF = 1e6
"""m/s that are no limit of the speed."""
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
