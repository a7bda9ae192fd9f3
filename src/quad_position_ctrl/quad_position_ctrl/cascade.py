"""What the baseline position laws share: the bounded speed, and the way from acceleration to setpoint.

The limits are those of AIBS (``speed_limit``, ``thrust_vector``), so that laws are compared within the same bounds.
"""

from typing import NamedTuple

from quad_core.rotations import quaternion_from_euler
from quad_core.types import Actuation, AttitudeThrust, TrajectoryPoint, Vec3
from quad_core.vehicle import Vehicle, max_thrust
from quad_position_ctrl.aibs import Internals
from quad_position_ctrl.speed_limit import SpeedLimits, bounded_pair
from quad_position_ctrl.thrust_vector import LimitedLift, Limits, limited_lift, limited_thrust, thrust_projected


class Approach(NamedTuple):
    """Velocity towards the reference in m/s, world frame, and whether it had to be bounded."""

    velocity: Vec3
    limited: bool


class Reach(NamedTuple):
    """A lift (m/s^2, world) within the limits, its thrust in N along the actual body z axis, what was limited."""

    limits: LimitedLift
    thrust: float
    thrust_limited: bool


def approach(gain_xy: float, gain_z: float, error: Vec3, speed: SpeedLimits) -> Approach:
    """Return -gain times ``error`` (actual - desired, m), horizontally bounded by its length, vertically by its size.

    ``gain_xy``, ``gain_z`` > 0 in 1/s.
    """
    level = bounded_pair(-gain_xy * error.x, -gain_xy * error.y, 0.0, 0.0, gain_xy, speed.braking_xy, speed.max_xy)
    upright = bounded_pair(-gain_z * error.z, 0.0, 0.0, 0.0, gain_z, speed.braking_z, speed.max_z)
    return Approach(Vec3(level.x, level.y, upright.x), level.limited or upright.limited)


def reach(command: Vec3, vehicle: Vehicle, limits: Limits, axis_w: Vec3) -> Reach:
    """Return what comes nearest to the acceleration ``command`` (m/s^2, world frame, gravity not counted).

    ``axis_w``: actual body z axis in the world, on which the thrust is projected (Lee, Leok and McClamroch 2010).
    """
    most = limits.thrust * max_thrust(vehicle)
    bounded = limited_lift(command, vehicle.gravity, most / vehicle.mass, limits)
    wanted = thrust_projected(vehicle.mass, bounded.lift, axis_w)
    held = limited_thrust(wanted, limits.min_thrust * max_thrust(vehicle), most)
    return Reach(bounded, held.thrust, bounded.thrust_limited or held.limited)


def is_limited(reached: Reach, velocity_limited: bool, actuation: Actuation) -> bool:
    """Tell whether an integral must rest: a limit is met in the law or was met by the vehicle."""
    bounded = reached.limits
    return (
        velocity_limited
        or reached.thrust_limited
        or bounded.acceleration_limited
        or bounded.descent_limited
        or bounded.tilt_limited
        or actuation.thrust_high
        or actuation.thrust_low
    )


def setpoint(vehicle: Vehicle, reference: TrajectoryPoint, angles: Vec3, thrust: float) -> AttitudeThrust:
    """Return the setpoint of ``angles`` (phi, theta, psi in rad) and ``thrust`` in N; derivatives of yaw only."""
    fraction = limited_thrust(thrust / max_thrust(vehicle), 0.0, 1.0).thrust
    return AttitudeThrust(
        angles,
        Vec3(0.0, 0.0, reference.yaw_rate),
        Vec3(0.0, 0.0, reference.yaw_acceleration),
        quaternion_from_euler(angles),
        thrust,
        fraction,
    )


def difference(actual: Vec3, desired: Vec3) -> Vec3:
    """Return actual - desired."""
    return Vec3(actual.x - desired.x, actual.y - desired.y, actual.z - desired.z)


def plain_internals(
    error: Vec3,
    error_v: Vec3,
    v_d: Vec3,
    command: Vec3,
    estimate: Vec3,
    wanted: Approach,
    reached: Reach,
    frozen: bool,
) -> Internals:
    """Return the internals of a law without integral backstepping: what it has of them, zero for the rest.

    ``error`` m, ``error_v`` and ``v_d`` m/s, ``command`` and ``estimate`` (of the disturbance) m/s^2, world frame.
    """
    zero = Vec3(0.0, 0.0, 0.0)
    return Internals(
        position_error=error,
        velocity_error=error_v,
        error_integral=zero,
        adaptive_gain=zero,
        virtual_velocity=v_d,
        acceleration_command=command,
        disturbance_estimate=estimate,
        lyapunov=0.0,
        lyapunov_rate=0.0,
        velocity_limited=wanted.limited,
        acceleration_limited=reached.limits.acceleration_limited,
        tilt_limited=reached.limits.tilt_limited,
        thrust_limited=reached.thrust_limited,
        descent_limited=reached.limits.descent_limited,
        adaptation_frozen=frozen,
    )
