"""AIBS: adaptive integral backstepping, the paper's position law (eqs. 18-38), a ``quad.position_law`` plug-in.

One step: errors (18, 25) -> virtual velocity (23), bounded -> acceleration command (30) -> thrust and attitude (38),
limited -> then, with the values *before* this step used throughout, forward Euler of the integral (21) and the
adaptive gain (37). ``backstepping`` holds the equations per axis, ``axis`` puts them together, ``thrust_vector`` is
Eq. 38, ``speed_limit`` and ``disturbance_observer`` are the larger additions.
Why parameters leave Table 2: docs/decisions/0002-additions-to-the-paper.md.
"""

from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Flag, Value
from quad_core.rotations import body_z, euler_from_quaternion, quaternion_from_euler
from quad_core.types import AttitudeThrust, PositionInputs, TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle, max_thrust
from quad_position_ctrl.axis import Axis, AxisCommand, Correction, Motion, axis_command, updated_gain
from quad_position_ctrl.backstepping import correction_velocity, drag_model, lyapunov, lyapunov_rate, next_integral
from quad_position_ctrl.disturbance_observer import Observer, estimate
from quad_position_ctrl.speed_limit import SpeedLimits, bounded_pair
from quad_position_ctrl.thrust_vector import (
    LimitedLift,
    Limits,
    desired_angles,
    limited_lift,
    limited_thrust,
    thrust_norm,
    thrust_projected,
)

THRUST_NORM = 0
THRUST_PROJECTED = 1
HEADING_REFERENCE = 0
HEADING_MEASURED = 1


class Parameters(NamedTuple):
    """Parameters of AIBS; the defaults are the preset ``tuned``."""

    x: Axis = Axis()
    y: Axis = Axis()
    z: Axis = Axis()
    drag_sign: Annotated[
        int, Choice(("corrected", "printed"), "sign of a_7..a_9: drag slows down, or as printed", "eqs. 5, 17, 30")
    ] = 0
    thrust_form: Annotated[
        int, Choice(("norm", "projected"), "F_T as printed, or projected on the actual thrust axis", "Eq. 38")
    ] = THRUST_PROJECTED
    tilt_heading: Annotated[
        int,
        Choice(("reference", "measured"), "yaw in whose frame thrust is tilted: psi_d, or the vehicle's", "Eq. 38"),
    ] = HEADING_MEASURED
    anti_windup: Annotated[
        bool, Flag("integrals and adaptive gains rest while a limit is met, here or in `actuation`", "eqs. 21, 37")
    ] = True
    speed: SpeedLimits = SpeedLimits()
    limits: Limits = Limits()
    observer: Observer = Observer()


class Memory(NamedTuple):
    """What AIBS keeps from step to step: Gamma, xi_hat, and what the disturbance estimate compares with."""

    error_integral: Vec3 = Vec3()
    adaptive_gain: Vec3 = Vec3()
    disturbance_estimate: Vec3 = Vec3()
    velocity: Vec3 = Vec3()
    thrust_axis: Vec3 = Vec3()
    thrust: float = 0.0
    initialised: float = 0.0


class Internals(NamedTuple):
    """Fields of quad_msgs/PositionInternals."""

    position_error: Vec3 = Vec3()
    velocity_error: Vec3 = Vec3()
    error_integral: Vec3 = Vec3()
    adaptive_gain: Vec3 = Vec3()
    virtual_velocity: Vec3 = Vec3()
    acceleration_command: Vec3 = Vec3()
    disturbance_estimate: Vec3 = Vec3()
    lyapunov: float = 0.0
    lyapunov_rate: float = 0.0
    velocity_limited: bool = False
    acceleration_limited: bool = False
    tilt_limited: bool = False
    thrust_limited: bool = False
    descent_limited: bool = False
    adaptation_frozen: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: Gamma = 0, xi_hat = xi_hat(0)."""
    gains = Vec3(parameters.x.initial_gain, parameters.y.initial_gain, parameters.z.initial_gain)
    zero = Vec3(0.0, 0.0, 0.0)
    return Memory(zero, gains, zero, zero, zero, 0.0, 0.0)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s (eqs. 18-38). Raises nothing on flyable inputs."""
    state = inputs.state
    axis_w = body_z(state.q_wb)
    drag = drag_model(vehicle.drag_coefficient, vehicle.mass, parameters.drag_sign)
    disturbance = memory.disturbance_estimate
    if memory.initialised > 0.0:
        disturbance = estimate(
            parameters.observer,
            vehicle,
            disturbance,
            memory.velocity,
            state.v_w,
            memory.thrust_axis,
            axis_w,
            memory.thrust,
            inputs.actuation.thrust,
            drag,
            dt,
        )
    motion_x, motion_y, motion_z = _motions(state, inputs.reference)
    to_x, to_y, to_z = _corrections(parameters, motion_x, motion_y, motion_z, memory.error_integral)
    gain = memory.adaptive_gain
    integral = memory.error_integral
    x = axis_command(parameters.x, gain.x, integral.x, drag, motion_x, to_x, disturbance.x)
    y = axis_command(parameters.y, gain.y, integral.y, drag, motion_y, to_y, disturbance.y)
    z = axis_command(parameters.z, gain.z, integral.z, drag, motion_z, to_z, disturbance.z)

    limits = parameters.limits
    most = limits.thrust * max_thrust(vehicle)
    command = Vec3(x.acceleration, y.acceleration, z.acceleration)
    reach = limited_lift(command, vehicle.gravity, most / vehicle.mass, limits)
    setpoint, thrust_held = _setpoint(parameters, vehicle, state, inputs.reference, reach.lift, axis_w)

    velocity_limited = to_x.limited or to_z.limited
    thrust_limited = reach.thrust_limited or thrust_held
    frozen = parameters.anti_windup and (
        velocity_limited
        or thrust_limited
        or reach.acceleration_limited
        or reach.descent_limited
        or reach.tilt_limited
        or inputs.actuation.thrust_high
        or inputs.actuation.thrust_low
    )
    next_integrals, next_gains = integral, gain
    if not frozen:
        next_integrals, next_gains = _adapted(parameters, integral, gain, x, y, z, dt)
    kept = Memory(next_integrals, next_gains, disturbance, state.v_w, axis_w, setpoint.thrust, 1.0)
    internals = _internals(parameters, memory, x, y, z, disturbance, reach, velocity_limited, thrust_limited, frozen)
    return setpoint, kept, internals


def _motions(state: VehicleState, reference: TrajectoryPoint) -> tuple[Motion, Motion, Motion]:
    p, v, p_d, v_d, a_d = state.p_w, state.v_w, reference.p_w, reference.v_w, reference.a_w
    return (
        Motion(p.x, v.x, p_d.x, v_d.x, a_d.x),
        Motion(p.y, v.y, p_d.y, v_d.y, a_d.y),
        Motion(p.z, v.z, p_d.z, v_d.z, a_d.z),
    )


def _corrections(
    parameters: Parameters, x: Motion, y: Motion, z: Motion, integral: Vec3
) -> tuple[Correction, Correction, Correction]:
    """Return the bounded correction of Eq. 23: by its length in the horizontal plane, by its size along z.

    Its derivative counts Gamma as resting, which it does wherever the bound is met and the derivative used.
    """
    ax, ay, az = parameters.x, parameters.y, parameters.z
    speed = parameters.speed
    fastest = ax.position_gain
    if ay.position_gain > fastest:
        fastest = ay.position_gain
    level = bounded_pair(
        correction_velocity(ax.position_gain, ax.integral_gain, x.position - x.reference_position, integral.x),
        correction_velocity(ay.position_gain, ay.integral_gain, y.position - y.reference_position, integral.y),
        -ax.position_gain * (x.velocity - x.reference_velocity),
        -ay.position_gain * (y.velocity - y.reference_velocity),
        fastest,
        speed.braking_xy,
        speed.max_xy,
    )
    upright = bounded_pair(
        correction_velocity(az.position_gain, az.integral_gain, z.position - z.reference_position, integral.z),
        0.0,
        -az.position_gain * (z.velocity - z.reference_velocity),
        0.0,
        az.position_gain,
        speed.braking_z,
        speed.max_z,
    )
    return (
        Correction(level.x, level.rate_x, level.scale, level.limited),
        Correction(level.y, level.rate_y, level.scale, level.limited),
        Correction(upright.x, upright.rate_x, upright.scale, upright.limited),
    )


def _setpoint(
    parameters: Parameters,
    vehicle: Vehicle,
    state: VehicleState,
    reference: TrajectoryPoint,
    lift: Vec3,
    axis_w: Vec3,
) -> tuple[AttitudeThrust, bool]:
    """Return Eq. 38 of the ``lift`` in m/s^2, thrust held in its range, and whether it had to be."""
    most = max_thrust(vehicle)
    limits = parameters.limits
    wanted = thrust_norm(vehicle.mass, lift)
    if parameters.thrust_form != THRUST_NORM:
        wanted = thrust_projected(vehicle.mass, lift, axis_w)
    held = limited_thrust(wanted, limits.min_thrust * most, limits.thrust * most)
    heading = reference.yaw
    if parameters.tilt_heading != HEADING_REFERENCE:
        heading = euler_from_quaternion(state.q_wb).z
    angles = desired_angles(lift, heading, reference.yaw)
    setpoint = AttitudeThrust(
        angles,
        Vec3(0.0, 0.0, reference.yaw_rate),
        Vec3(0.0, 0.0, reference.yaw_acceleration),
        quaternion_from_euler(angles),
        held.thrust,
        limited_thrust(held.thrust / most, 0.0, 1.0).thrust,
    )
    return setpoint, held.limited


def _adapted(
    parameters: Parameters, integral: Vec3, gain: Vec3, x: AxisCommand, y: AxisCommand, z: AxisCommand, dt: float
) -> tuple[Vec3, Vec3]:
    """Return Gamma (Eq. 21) and xi_hat (Eq. 37) after the step."""
    return (
        Vec3(
            next_integral(integral.x, x.error, parameters.x.max_integral, dt),
            next_integral(integral.y, y.error, parameters.y.max_integral, dt),
            next_integral(integral.z, z.error, parameters.z.max_integral, dt),
        ),
        Vec3(
            updated_gain(parameters.x, gain.x, x.velocity_error, dt),
            updated_gain(parameters.y, gain.y, y.velocity_error, dt),
            updated_gain(parameters.z, gain.z, z.velocity_error, dt),
        ),
    )


def _internals(
    parameters: Parameters,
    memory: Memory,
    x: AxisCommand,
    y: AxisCommand,
    z: AxisCommand,
    disturbance: Vec3,
    reach: LimitedLift,
    velocity_limited: bool,
    thrust_limited: bool,
    frozen: bool,
) -> Internals:
    integral, gain = memory.error_integral, memory.adaptive_gain
    return Internals(
        Vec3(x.error, y.error, z.error),
        Vec3(x.velocity_error, y.velocity_error, z.velocity_error),
        integral,
        gain,
        Vec3(x.virtual_velocity, y.virtual_velocity, z.virtual_velocity),
        Vec3(x.acceleration, y.acceleration, z.acceleration),
        disturbance,
        lyapunov(parameters.x.integral_gain, x.error, x.velocity_error, integral.x)
        + lyapunov(parameters.y.integral_gain, y.error, y.velocity_error, integral.y)
        + lyapunov(parameters.z.integral_gain, z.error, z.velocity_error, integral.z),
        lyapunov_rate(parameters.x.position_gain, gain.x, x.error, x.velocity_error)
        + lyapunov_rate(parameters.y.position_gain, gain.y, y.error, y.velocity_error)
        + lyapunov_rate(parameters.z.position_gain, gain.z, z.error, z.velocity_error),
        velocity_limited,
        reach.acceleration_limited,
        reach.tilt_limited,
        thrust_limited,
        reach.descent_limited,
        frozen,
    )


_PRINTED: dict[str, Value] = {
    "drag_sign": "printed",
    "thrust_form": "norm",
    "tilt_heading": "reference",
    "anti_windup": False,
    "observer.bandwidth": 0.0,
    **{f"{axis}.initial_gain": 1.0 for axis in "xyz"},
    **{f"{axis}.adaptation_leak": 0.0 for axis in "xyz"},
    **{f"{axis}.max_gain": 1e9 for axis in "xyz"},
    **{f"{axis}.max_integral": 1e9 for axis in "xyz"},
    **{f"speed.{name}": 1e6 for name in ("max_xy", "max_z", "braking_xy", "braking_z")},
    "limits.acceleration_xy": 1e6,
    "limits.acceleration_z": 1e6,
    "limits.min_lift": -1e6,
    "limits.tilt": 1.58,
    "limits.thrust": 1e6,
    "limits.min_thrust": 0.0,
    "limits.vertical_priority": False,
}
_SMALLEST_SET = ("drag_sign", "anti_windup", "speed.", "limits.tilt")
"""What of the additions is enough to fly the paper's cases from its initial condition (docs/as_printed.md)."""

PRESETS: dict[str, dict[str, Value]] = {
    "tuned": {},
    "minimal": {name: value for name, value in _PRINTED.items() if not name.startswith(_SMALLEST_SET)},
    "printed": _PRINTED,
}
