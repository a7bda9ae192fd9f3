"""An estimate of the disturbance d of Eq. 16 from velocity and thrust, to fill the -d of Eq. 30 (an addition).

A first-order observer on the velocity: what the velocity did over the last step minus what thrust, gravity and drag
explain is the disturbance, low-passed with the bandwidth L. Source: the momentum observer of De Luca et al., IROS 2006,
for a point mass; on multirotors: Tomic, Ott and Haddadin, IEEE T-RO 33(6), 2017. The estimate has the transfer
function L/(s + L); as thrust and attitude enter as they *are*, limits cannot wind it up.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Real
from quad_core.types import Vec3
from quad_core.vehicle import Vehicle

THRUST_ACHIEVED = 0


class Observer(NamedTuple):
    """Parameters of the disturbance estimate (``printed``: bandwidth 0, no estimate)."""

    bandwidth: Annotated[float, Real("rad/s", "bandwidth L of the estimate of d; 0: off", 0.0, 200.0, "addition")] = (
        12.0
    )
    max_estimate: Annotated[float, Real("m/s^2", "bound of the estimate per axis", 0.0, 100.0, "addition")] = 5.0
    thrust: Annotated[
        int,
        Choice(
            ("achieved", "commanded"), "thrust that is counted with: as `actuation` says, or as commanded", "addition"
        ),
    ] = THRUST_ACHIEVED


def known_acceleration(
    thrust_acceleration: float, axis_before: float, axis_now: float, gravity: float, drag: float, velocity: float
) -> float:
    """Return the acceleration in m/s^2 along one world axis that thrust, gravity and drag explain over the last step.

    ``thrust_acceleration`` = F_T/m; ``axis_before``, ``axis_now``: this component of the body z axis at both ends of
    the step (their mean is used); ``gravity`` = g on the z axis, 0 on x and y; ``drag`` = a_7 in 1/s; ``velocity`` m/s.
    """
    return thrust_acceleration * 0.5 * (axis_before + axis_now) - gravity + drag * velocity


def next_estimate(
    estimate: float,
    velocity_before: float,
    velocity_now: float,
    acceleration: float,
    bandwidth: float,
    max_estimate: float,
    dt: float,
) -> float:
    """Return the estimate of d in m/s^2 after a step of ``dt`` s; exact for a d that is constant over the step.

    ``acceleration`` is that of ``known_acceleration``; ``bandwidth`` L in rad/s, 0 keeps the estimate; the result stays
    within +-``max_estimate``.
    """
    gain = 1.0 - math.exp(-bandwidth * dt)
    seen = (velocity_now - velocity_before) / dt - acceleration
    moved = estimate + gain * (seen - estimate)
    if moved > max_estimate:
        return max_estimate
    if moved < -max_estimate:
        return -max_estimate
    return moved


def estimate(
    observer: Observer,
    vehicle: Vehicle,
    before: Vec3,
    velocity_before: Vec3,
    velocity_now: Vec3,
    axis_before: Vec3,
    axis_now: Vec3,
    commanded_thrust: float,
    achieved_thrust: float,
    drag: float,
    dt: float,
) -> Vec3:
    """Return the estimate of d in m/s^2, world frame, from what happened over the last step of ``dt`` s.

    ``before`` is the estimate so far; velocities in m/s and body z axes in the world at both ends of the step; thrusts
    in N that were commanded and achieved over it; ``drag`` a_7 in 1/s.
    """
    if observer.bandwidth <= 0.0:
        return before
    thrust = achieved_thrust if observer.thrust == THRUST_ACHIEVED else commanded_thrust
    lift = thrust / vehicle.mass
    known_x = known_acceleration(lift, axis_before.x, axis_now.x, 0.0, drag, velocity_now.x)
    known_y = known_acceleration(lift, axis_before.y, axis_now.y, 0.0, drag, velocity_now.y)
    known_z = known_acceleration(lift, axis_before.z, axis_now.z, vehicle.gravity, drag, velocity_now.z)
    width, most = observer.bandwidth, observer.max_estimate
    return Vec3(
        next_estimate(before.x, velocity_before.x, velocity_now.x, known_x, width, most, dt),
        next_estimate(before.y, velocity_before.y, velocity_now.y, known_y, width, most, dt),
        next_estimate(before.z, velocity_before.z, velocity_now.z, known_z, width, most, dt),
    )
