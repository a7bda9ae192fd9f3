"""AIBS: adaptive integral backstepping, the paper's position law (eqs. 18-38), a ``quad.position_law`` plug-in.

One step: errors (18, 25) -> virtual velocity (23), bounded -> acceleration command (30) -> thrust and attitude (38),
limited -> then, with the values *before* this step used throughout, forward Euler of the integral (21) and the
adaptive gain (37). ``backstepping`` holds the equations per axis, ``thrust_vector`` Eq. 38, ``speed_limit`` and
``disturbance_observer`` the two larger additions. Why parameters leave Table 2: docs/decisions/0002.
"""

from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Flag, Real, Value
from quad_core.rotations import body_z, euler_from_quaternion, quaternion_from_euler
from quad_core.types import AttitudeThrust, PositionInputs, Vec3
from quad_core.vehicle import Vehicle, max_thrust
from quad_position_ctrl.backstepping import (
    acceleration_command,
    adaptive_rate,
    bounded_acceleration_command,
    correction_velocity,
    drag_model,
    lyapunov,
    lyapunov_rate,
    next_adaptive_gain,
    next_integral,
    tracking_error,
    virtual_velocity,
)
from quad_position_ctrl.disturbance_observer import THRUST_ACHIEVED, Observer, known_acceleration, next_estimate
from quad_position_ctrl.speed_limit import BoundedPair, SpeedLimits, bounded_pair
from quad_position_ctrl.thrust_vector import (
    Limits,
    desired_angles,
    limited_lift,
    limited_thrust,
    thrust_norm,
    thrust_projected,
)

THRUST_NORM = 0
HEADING_REFERENCE = 0


class Axis(NamedTuple):
    """Gains of one axis; named after the x axis, the same on y (9, 10) and z (11, 12)."""

    position_gain: Annotated[float, Real("1/s", "xi_7", 0.01, 100.0, "Table 2, Eq. 23")] = 4.25
    integral_gain: Annotated[float, Real("1/s^2", "k_7", 0.0, 100.0, "Table 2, Eq. 23")] = 0.01
    max_integral: Annotated[float, Real("m s", "bound of Gamma_7; 1e9: off", 0.0, 1e9, "addition to Eq. 21")] = 20.0
    adaptation_rate: Annotated[float, Real("1/m^2 s", "alpha_8; 0: fixed gain", 0.0, 1e4, "Table 2, Eq. 37")] = 2.5
    initial_gain: Annotated[float, Real("1/s", "xi_hat_8(0), which the paper does not give", 0.0, 1e3, "Eq. 37")] = 8.0
    max_gain: Annotated[float, Real("1/s", "bound of xi_hat_8; 1e9: off", 0.0, 1e9, "addition to Eq. 37")] = 12.0
    adaptation_leak: Annotated[
        float,
        Real("1/s", "rate at which xi_hat_8 returns to xi_hat_8(0); 0: as printed", 0.0, 100.0, "addition to Eq. 37"),
    ] = 0.0


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
    ] = 1
    tilt_heading: Annotated[
        int,
        Choice(
            ("reference", "measured"),
            "yaw in whose frame thrust is tilted: psi_d as printed, or the vehicle's",
            "Eq. 38",
        ),
    ] = 1
    anti_windup: Annotated[
        bool,
        Flag(
            "integrals and adaptive gains rest while a limit is met, here or in `actuation`", "addition to eqs. 21, 37"
        ),
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


class AxisCommand(NamedTuple):
    """One axis of eqs. 23, 25 and 30: x_8d in m/s, e_8 in m/s, U_x in m/s^2."""

    virtual_velocity: float
    velocity_error: float
    acceleration: float


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001
    """Return the memory before the first step: Gamma = 0, xi_hat = xi_hat(0)."""
    gains = Vec3(parameters.x.initial_gain, parameters.y.initial_gain, parameters.z.initial_gain)
    zero = Vec3(0.0, 0.0, 0.0)
    return Memory(zero, gains, zero, zero, zero, 0.0, 0.0)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s (eqs. 18-38). Never raises on flyable inputs."""
    state = inputs.state
    reference = inputs.reference
    thrust_axis = body_z(state.q_wb)
    drag = drag_model(vehicle.drag_coefficient, vehicle.mass, parameters.drag_sign)
    disturbance = _disturbance(parameters.observer, vehicle, memory, inputs, thrust_axis, drag, dt)

    error = Vec3(
        tracking_error(state.p_w.x, reference.p_w.x),
        tracking_error(state.p_w.y, reference.p_w.y),
        tracking_error(state.p_w.z, reference.p_w.z),
    )
    error_rate = Vec3(state.v_w.x - reference.v_w.x, state.v_w.y - reference.v_w.y, state.v_w.z - reference.v_w.z)
    integral = memory.error_integral
    gain = memory.adaptive_gain
    horizontal, vertical = _corrections(parameters, error, error_rate, integral)
    x = _axis_command(
        parameters.x, gain.x, drag, error.x, integral.x, state.v_w.x, reference.v_w.x, reference.a_w.x,
        horizontal.x, horizontal.rate_x, horizontal.scale, horizontal.limited, disturbance.x,
    )  # fmt: skip
    y = _axis_command(
        parameters.y, gain.y, drag, error.y, integral.y, state.v_w.y, reference.v_w.y, reference.a_w.y,
        horizontal.y, horizontal.rate_y, horizontal.scale, horizontal.limited, disturbance.y,
    )  # fmt: skip
    z = _axis_command(
        parameters.z, gain.z, drag, error.z, integral.z, state.v_w.z, reference.v_w.z, reference.a_w.z,
        vertical.x, vertical.rate_x, vertical.scale, vertical.limited, disturbance.z,
    )  # fmt: skip
    command = Vec3(x.acceleration, y.acceleration, z.acceleration)
    velocity_error = Vec3(x.velocity_error, y.velocity_error, z.velocity_error)

    most = max_thrust(vehicle)
    reach = limited_lift(command, vehicle.gravity, parameters.limits.thrust * most / vehicle.mass, parameters.limits)
    wanted = (
        thrust_norm(vehicle.mass, reach.lift)
        if parameters.thrust_form == THRUST_NORM
        else thrust_projected(vehicle.mass, reach.lift, thrust_axis)
    )
    held = limited_thrust(wanted, parameters.limits.min_thrust * most, parameters.limits.thrust * most)
    heading = reference.yaw
    if parameters.tilt_heading != HEADING_REFERENCE:
        heading = euler_from_quaternion(state.q_wb).z
    angles = desired_angles(reach.lift, heading, reference.yaw)
    setpoint = AttitudeThrust(
        angles,
        Vec3(0.0, 0.0, reference.yaw_rate),
        Vec3(0.0, 0.0, reference.yaw_acceleration),
        quaternion_from_euler(angles),
        held.thrust,
        limited_thrust(held.thrust / most, 0.0, 1.0).thrust,
    )

    velocity_limited = horizontal.limited or vertical.limited
    thrust_limited = reach.thrust_limited or held.limited
    frozen = parameters.anti_windup and (
        velocity_limited
        or thrust_limited
        or reach.acceleration_limited
        or reach.descent_limited
        or reach.tilt_limited
        or inputs.actuation.thrust_high
        or inputs.actuation.thrust_low
    )
    next_integrals = integral
    next_gains = gain
    if not frozen:
        next_integrals = Vec3(
            next_integral(integral.x, error.x, parameters.x.max_integral, dt),
            next_integral(integral.y, error.y, parameters.y.max_integral, dt),
            next_integral(integral.z, error.z, parameters.z.max_integral, dt),
        )
        next_gains = Vec3(
            _next_gain(parameters.x, gain.x, x.velocity_error, dt),
            _next_gain(parameters.y, gain.y, y.velocity_error, dt),
            _next_gain(parameters.z, gain.z, z.velocity_error, dt),
        )
    internals = Internals(
        position_error=error,
        velocity_error=velocity_error,
        error_integral=integral,
        adaptive_gain=gain,
        virtual_velocity=Vec3(x.virtual_velocity, y.virtual_velocity, z.virtual_velocity),
        acceleration_command=command,
        disturbance_estimate=disturbance,
        lyapunov=lyapunov(parameters.x.integral_gain, error.x, x.velocity_error, integral.x)
        + lyapunov(parameters.y.integral_gain, error.y, y.velocity_error, integral.y)
        + lyapunov(parameters.z.integral_gain, error.z, z.velocity_error, integral.z),
        lyapunov_rate=lyapunov_rate(parameters.x.position_gain, gain.x, error.x, x.velocity_error)
        + lyapunov_rate(parameters.y.position_gain, gain.y, error.y, y.velocity_error)
        + lyapunov_rate(parameters.z.position_gain, gain.z, error.z, z.velocity_error),
        velocity_limited=velocity_limited,
        acceleration_limited=reach.acceleration_limited,
        tilt_limited=reach.tilt_limited,
        thrust_limited=thrust_limited,
        descent_limited=reach.descent_limited,
        adaptation_frozen=frozen,
    )
    kept = Memory(next_integrals, next_gains, disturbance, state.v_w, thrust_axis, held.thrust, 1.0)
    return setpoint, kept, internals


def _corrections(
    parameters: Parameters, error: Vec3, error_rate: Vec3, integral: Vec3
) -> tuple[BoundedPair, BoundedPair]:
    """Return the bounded correction of Eq. 23 in the horizontal plane, and along z in the pair's x."""
    px, py, pz = parameters.x, parameters.y, parameters.z
    speed = parameters.speed
    gain_xy = px.position_gain if px.position_gain > py.position_gain else py.position_gain
    horizontal = bounded_pair(
        correction_velocity(px.position_gain, px.integral_gain, error.x, integral.x),
        correction_velocity(py.position_gain, py.integral_gain, error.y, integral.y),
        -px.position_gain * error_rate.x,
        -py.position_gain * error_rate.y,
        gain_xy,
        speed.braking_xy,
        speed.max_xy,
    )
    vertical = bounded_pair(
        correction_velocity(pz.position_gain, pz.integral_gain, error.z, integral.z),
        0.0,
        -pz.position_gain * error_rate.z,
        0.0,
        pz.position_gain,
        speed.braking_z,
        speed.max_z,
    )
    return horizontal, vertical


def _axis_command(
    axis: Axis,
    adaptive_gain: float,
    drag: float,
    error: float,
    integral: float,
    velocity: float,
    reference_velocity: float,
    reference_acceleration: float,
    correction: float,
    correction_rate: float,
    scale: float,
    limited: bool,
    disturbance: float,
) -> AxisCommand:
    """Return eqs. 23, 25 and 30 of one axis; ``correction`` and what follows it are those of the bounded Eq. 23."""
    if limited:
        virtual = reference_velocity + correction
        velocity_error = tracking_error(velocity, virtual)
        acceleration = bounded_acceleration_command(
            adaptive_gain,
            drag,
            scale * error,
            velocity_error,
            velocity,
            reference_acceleration + correction_rate,
            disturbance,
        )
        return AxisCommand(virtual, velocity_error, acceleration)
    virtual = virtual_velocity(axis.position_gain, axis.integral_gain, error, integral, reference_velocity)
    velocity_error = tracking_error(velocity, virtual)
    acceleration = acceleration_command(
        axis.position_gain,
        axis.integral_gain,
        adaptive_gain,
        drag,
        error,
        velocity_error,
        integral,
        velocity,
        reference_acceleration,
        disturbance,
    )
    return AxisCommand(virtual, velocity_error, acceleration)


def _next_gain(axis: Axis, gain: float, velocity_error: float, dt: float) -> float:
    rate = adaptive_rate(axis.adaptation_rate, velocity_error)
    return next_adaptive_gain(gain, rate, axis.adaptation_leak, axis.initial_gain, axis.max_gain, dt)


def _disturbance(
    observer: Observer, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, axis: Vec3, drag: float, dt: float
) -> Vec3:
    """Return the estimate of d in m/s^2, world frame, from what happened since the step before."""
    if observer.bandwidth <= 0.0 or memory.initialised <= 0.0:
        return memory.disturbance_estimate
    thrust = inputs.actuation.thrust if observer.thrust == THRUST_ACHIEVED else memory.thrust
    lift = thrust / vehicle.mass
    before = memory.thrust_axis
    then = memory.velocity
    now = inputs.state.v_w
    old = memory.disturbance_estimate
    width, most = observer.bandwidth, observer.max_estimate
    known_x = known_acceleration(lift, before.x, axis.x, 0.0, drag, now.x)
    known_y = known_acceleration(lift, before.y, axis.y, 0.0, drag, now.y)
    known_z = known_acceleration(lift, before.z, axis.z, vehicle.gravity, drag, now.z)
    return Vec3(
        next_estimate(old.x, then.x, now.x, known_x, width, most, dt),
        next_estimate(old.y, then.y, now.y, known_y, width, most, dt),
        next_estimate(old.z, then.z, now.z, known_z, width, most, dt),
    )


_OFF_AXIS: dict[str, Value] = {"initial_gain": 1.0, "max_integral": 1e9, "max_gain": 1e9}

PRESETS: dict[str, dict[str, Value]] = {
    "tuned": {},
}
