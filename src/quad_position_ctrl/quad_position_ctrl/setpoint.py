"""From an acceleration command to thrust and attitude, within limits: Eq. 38, shared by all laws of this package.

    L     = U + g e_z, within LiftLimits                           lift, m/s^2, world frame: thrust vector over mass
    F_T   = m |L|                                                  collective thrust, N
    theta = atan((cos psi L_x + sin psi L_y) / L_z)                pitch, rad
    phi   = atan(cos theta (sin psi L_x - cos psi L_y) / L_z)      roll, rad

Laws differ in how they choose U and the angles that point the lift, and in nothing that stands here. All know the drag
of the nominal vehicle. The limits are not in the paper; all laws are compared within the same ones.
"""

import math
from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, clamp, dot, norm, quaternion_from_euler, rotated_by_vector, wrap_angle
from quad_core.parameters import Flag, Real, Value
from quad_core.types import Actuation, AttitudeThrust, PositionInternals, TrajectoryPoint, Vec3
from quad_core.vehicle import DragSign, Vehicle, max_thrust
from quad_position_ctrl.flatness import angle_derivatives
from quad_position_ctrl.speed_limit import BoundedCorrection, is_speed_limited


class LiftLimits(NamedTuple):
    """What the law may ask of the vehicle; none of it is in the paper (``printed``: all out of reach)."""

    acceleration_xy: Annotated[
        float, Real("m/s^2", "largest horizontal part of U; 1e6: off", 0.1, 1e6, "addition to Eq. 30")
    ] = 12.0
    acceleration_z: Annotated[
        float, Real("m/s^2", "largest vertical part of U, both ways; 1e6: off", 0.1, 1e6, "addition to Eq. 30")
    ] = 7.0
    min_lift: Annotated[
        float,
        Real("", "floor of (U_z + g)/g: below 0 Eq. 38 commands upright; -1e6: off", -1e6, 1.0, "addition to Eq. 38"),
    ] = 0.3
    tilt: Annotated[
        float, Real("rad", "largest angle between desired thrust and vertical; >= 1.57: off", 0.05, 1.58, "addition")
    ] = 0.87
    thrust: Annotated[
        float, Real("", "largest thrust as a fraction of the vehicle's largest; 1e6: off", 0.1, 1e6, "addition")
    ] = 1.0
    min_thrust: Annotated[
        float, Real("", "smallest thrust as a fraction of the vehicle's largest", 0.0, 0.5, "addition")
    ] = 0.02
    vertical_priority: Annotated[
        bool, Flag("missing thrust is taken from the horizontal part first; false: in proportion")
    ] = True


class LimitedLift(NamedTuple):
    """A lift in m/s^2 that the vehicle can have, and which limits it met."""

    lift: Vec3
    acceleration_limited: bool
    descent_limited: bool
    thrust_limited: bool
    tilt_limited: bool


AntiWindup = Annotated[
    bool, Flag("what the law integrates rests while a limit is met, here or in `actuation`", "addition")
]
FeedForward = Annotated[
    bool, Flag("the setpoint carries the rates and accelerations that jerk and snap of the reference ask for")
]
"""Parameters that laws share."""


def limited_lift(command: Vec3, gravity: float, max_lift: float, limits: LiftLimits) -> LimitedLift:
    """Return the lift that comes nearest to U (``command``, m/s^2) within what the vehicle can have.

    In this order: bound the command (length in xy, size in z), keep the vertical part at or above ``min_lift`` g
    (below 0 Eq. 38 commands an upright attitude and full thrust), keep the length within ``max_lift`` (m/s^2; vertical
    part first if ``vertical_priority``, else all in proportion), then the angle to the vertical within ``tilt`` (rad)
    by shortening the horizontal part. ``gravity`` in m/s^2.
    """
    x = command.x
    y = command.y
    climb = clamp(command.z, -limits.acceleration_z, limits.acceleration_z)
    acceleration_limited = climb != command.z
    horizontal = math.sqrt(x * x + y * y)
    if horizontal > limits.acceleration_xy:
        x = x * limits.acceleration_xy / horizontal
        y = y * limits.acceleration_xy / horizontal
        horizontal = limits.acceleration_xy
        acceleration_limited = True

    vertical = climb + gravity
    descent_limited = vertical < limits.min_lift * gravity
    if descent_limited:
        vertical = limits.min_lift * gravity

    allowed = horizontal
    thrust_limited = horizontal * horizontal + vertical * vertical > max_lift * max_lift
    if thrust_limited and limits.vertical_priority:
        vertical = clamp(vertical, -max_lift, max_lift)
        allowed = math.sqrt(clamp(max_lift * max_lift - vertical * vertical, 0.0, max_lift * max_lift))
    elif thrust_limited:
        length = math.sqrt(horizontal * horizontal + vertical * vertical)
        vertical = vertical * max_lift / length
        allowed = horizontal * max_lift / length

    cone = allowed
    if limits.tilt < 1.57:
        cone = clamp(vertical, 0.0, abs(vertical)) * math.tan(limits.tilt)
    tilt_limited = allowed > cone
    if tilt_limited:
        allowed = cone
    if horizontal > allowed:
        x = x * allowed / horizontal
        y = y * allowed / horizontal
    return LimitedLift(Vec3(x, y, vertical), acceleration_limited, descent_limited, thrust_limited, tilt_limited)


def drag_model(vehicle: Vehicle, drag_sign: int) -> float:
    """Return a_7 in 1/s (Eq. 17): -k_F/m, or +k_F/m as printed; each law adds -a_7 v to its command."""
    if drag_sign == DragSign.PRINTED:
        return vehicle.drag_coefficient / vehicle.mass
    return -vehicle.drag_coefficient / vehicle.mass


class ThrustForm(IntEnum):
    """How much thrust stands for a lift: its length as printed, or its part along the actual thrust axis."""

    NORM = 0
    PROJECTED = 1


class TiltHeading(IntEnum):
    """Yaw in whose frame the thrust is tilted: psi_d of the reference as printed, or the vehicle's."""

    REFERENCE = 0
    MEASURED = 1


def thrust_norm(mass: float, lift: Vec3) -> float:
    """Return F_T = m |U + g e_z| in N (Eq. 38, first line, as printed); ``mass`` in kg, ``lift`` in m/s^2."""
    return mass * norm(lift)


def thrust_projected(mass: float, lift: Vec3, thrust_axis: Vec3) -> float:
    """Return m (U + g e_z) . b_z in N: Eq. 38 when the attitude is not yet the desired one; equal to it when it is.

    ``thrust_axis`` is the actual body z axis in the world. Source: Lee, Leok and McClamroch, CDC 2010, eq. 19.
    """
    return mass * dot(lift, thrust_axis)


def desired_angles(lift: Vec3, heading: float, yaw: float) -> Vec3:
    """Return (phi_d, theta_d, psi_d) in rad (Eq. 38, second and third line; the printed psi_d of the third is phi_d).

    ``heading`` is the yaw in whose frame the thrust is tilted (psi_d as printed), ``yaw`` is the psi_d handed on.
    """
    vertical = lift.z
    if abs(vertical) < 1e-9:
        vertical = 1e-9
    cos_heading = math.cos(heading)
    sin_heading = math.sin(heading)
    theta = math.atan((cos_heading * lift.x + sin_heading * lift.y) / vertical)
    phi = math.atan(math.cos(theta) * (sin_heading * lift.x - cos_heading * lift.y) / vertical)
    return Vec3(phi, theta, yaw)


class ThrustCommand(NamedTuple):
    """A lift (m/s^2, world frame) within the limits, its collective thrust in N, and whether thrust was limited."""

    lift: LimitedLift
    thrust: float
    thrust_limited: bool


def thrust_command(
    command: Vec3, vehicle: Vehicle, limits: LiftLimits, thrust_axis: Vec3, thrust_form: int
) -> ThrustCommand:
    """Return what comes nearest to the acceleration ``command`` (m/s^2, world frame, gravity not counted).

    ``thrust_axis``: actual body z axis in the world; ``thrust_form``: a ``ThrustForm`` (Eq. 38).
    """
    full = max_thrust(vehicle)
    max_allowed, min_allowed = limits.thrust * full, limits.min_thrust * full
    lift = limited_lift(command, vehicle.gravity, max_allowed / vehicle.mass, limits)
    wanted = thrust_projected(vehicle.mass, lift.lift, thrust_axis)
    if thrust_form == ThrustForm.NORM:
        wanted = thrust_norm(vehicle.mass, lift.lift)
    thrust = clamp(wanted, min_allowed, max_allowed)
    return ThrustCommand(lift, thrust, lift.thrust_limited or thrust != wanted)


def attitude_setpoint(
    vehicle: Vehicle, reference: TrajectoryPoint, angles: Vec3, thrust: float, heading: float, feed_forward: bool
) -> AttitudeThrust:
    """Return the setpoint of ``angles`` (phi, theta, psi in rad) and ``thrust`` in N.

    ``heading`` is the yaw in whose frame phi and theta tilt the thrust; about that thrust the attitude then turns to
    psi. Its derivatives are those of the reference if ``feed_forward``, else those of its yaw alone.
    """
    rates, accelerations = Vec3(0.0, 0.0, reference.yaw_rate), Vec3(0.0, 0.0, reference.yaw_acceleration)
    if feed_forward:
        along = angle_derivatives(reference, heading, vehicle.gravity)
        rates, accelerations = along.rates, along.accelerations
    tilted = quaternion_from_euler(Vec3(angles.x, angles.y, heading))
    return AttitudeThrust(
        angles,
        rates,
        accelerations,
        rotated_by_vector(tilted, Vec3(0.0, 0.0, wrap_angle(angles.z - heading))),
        thrust,
        clamp(thrust / max_thrust(vehicle), 0.0, 1.0),
    )


def integrals_frozen(
    anti_windup: bool, correction: BoundedCorrection, thrust: ThrustCommand, actuation: Actuation
) -> bool:
    """Return whether what the law integrates must rest: a limit is met in the law, or was met by the vehicle."""
    return anti_windup and (
        is_speed_limited(correction)
        or thrust.thrust_limited
        or thrust.lift.acceleration_limited
        or thrust.lift.descent_limited
        or thrust.lift.tilt_limited
        or actuation.thrust_high
        or actuation.thrust_low
    )


def internals_of(
    position_error: Vec3,
    velocity_error: Vec3,
    virtual_velocity: Vec3,
    acceleration_command: Vec3,
    disturbance_estimate: Vec3,
    correction: BoundedCorrection,
    thrust: ThrustCommand,
    frozen: bool,
    error_integral: Vec3 = ZERO,
    adaptive_gain: Vec3 = ZERO,
    lyapunov: float = 0.0,
    lyapunov_rate: float = 0.0,
) -> PositionInternals:
    """Return what a law shows; what a law without integral backstepping has not is 0.

    World frame: ``position_error`` m, ``velocity_error`` and ``virtual_velocity`` m/s, ``acceleration_command`` and
    ``disturbance_estimate`` m/s^2; ``frozen``: its integrals rested. ``error_integral`` m s, ``adaptive_gain`` 1/s.
    """
    return PositionInternals(
        position_error=position_error,
        velocity_error=velocity_error,
        error_integral=error_integral,
        adaptive_gain=adaptive_gain,
        virtual_velocity=virtual_velocity,
        acceleration_command=acceleration_command,
        disturbance_estimate=disturbance_estimate,
        lyapunov=lyapunov,
        lyapunov_rate=lyapunov_rate,
        velocity_limited=is_speed_limited(correction),
        acceleration_limited=thrust.lift.acceleration_limited,
        tilt_limited=thrust.lift.tilt_limited,
        thrust_limited=thrust.thrust_limited,
        descent_limited=thrust.lift.descent_limited,
        adaptation_frozen=frozen,
    )


def slow_presets(also: dict[str, Value] | None = None, **gains: float) -> dict[str, dict[str, Value]]:
    """Return ``PRESETS`` of a law with ``gains`` for both axes (``xy``, ``z``), and what is ``also`` set.

    They are for a state 20 ms (x500) or 15 ms late and noisy, predicted, and rotors that lag: by hand on seed 1, not
    tuned.
    """
    both: dict[str, Value] = {f"{axes}.{name}": value for axes in ("xy", "z") for name, value in gains.items()}
    slow = {**(also or {}), **both}
    return {"tuned": {}, "x500": slow, "crazyflie21": slow}
