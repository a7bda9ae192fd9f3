"""An estimate of the disturbance d of Eq. 16 from velocity and thrust, to fill the -d of Eq. 30 (an addition).

    d_hat(k) = d_hat(k-1) + (1 - e^(-L dt)) (dv/dt - (F_T/m b_z - g e_z + a v) - d_hat(k-1))

A first-order observer on the velocity: what the velocity did over the last step minus what thrust, gravity and drag
explain is the disturbance, low-passed with the bandwidth L. Source: the momentum observer of De Luca et al., IROS 2006,
for a point mass; on multirotors: Tomic, Ott and Haddadin, IEEE T-RO 33(6), 2017. The estimate has the transfer
function L/(s + L); as thrust and attitude enter as they *are*, limits cannot wind it up.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.geometry import clamp
from quad_core.parameters import Real
from quad_core.types import Vec3
from quad_core.vehicle import Vehicle


class Observer(NamedTuple):
    """Parameters of the disturbance estimate (``printed``: bandwidth 0, no estimate)."""

    bandwidth: Annotated[float, Real("rad/s", "bandwidth L of the estimate of d; 0: off", 0.0, 200.0, "addition")] = (
        12.0
    )
    max_estimate: Annotated[float, Real("m/s^2", "largest estimate per axis", 0.0, 100.0, "addition")] = 5.0


class ObservedStep(NamedTuple):
    """The step that just ended: velocity m/s and body z axis (world frame) at both ends, thrust N that rotors gave."""

    velocity_before: Vec3
    velocity_now: Vec3
    axis_before: Vec3
    axis_now: Vec3
    thrust: float


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
    return clamp(estimate + gain * (seen - estimate), -max_estimate, max_estimate)


def estimate(observer: Observer, vehicle: Vehicle, before: Vec3, step: ObservedStep, drag: float, dt: float) -> Vec3:
    """Return the estimate of d in m/s^2, world frame, after a ``step`` of ``dt`` s.

    ``before`` is the estimate so far in m/s^2; ``drag`` a_7 in 1/s.
    """
    if observer.bandwidth <= 0.0:
        return before
    lift = step.thrust / vehicle.mass
    old, now, z_old, z_now = step.velocity_before, step.velocity_now, step.axis_before, step.axis_now
    known_x = known_acceleration(lift, z_old.x, z_now.x, 0.0, drag, now.x)
    known_y = known_acceleration(lift, z_old.y, z_now.y, 0.0, drag, now.y)
    known_z = known_acceleration(lift, z_old.z, z_now.z, vehicle.gravity, drag, now.z)
    bandwidth, bound = observer.bandwidth, observer.max_estimate
    return Vec3(
        next_estimate(before.x, old.x, now.x, known_x, bandwidth, bound, dt),
        next_estimate(before.y, old.y, now.y, known_y, bandwidth, bound, dt),
        next_estimate(before.z, old.z, now.z, known_z, bandwidth, bound, dt),
    )
