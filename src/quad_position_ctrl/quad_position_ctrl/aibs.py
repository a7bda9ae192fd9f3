"""AIBS: adaptive integral backstepping, the paper's position law (eqs. 18-38), a ``quad.position_law`` plug-in.

Along x, world frame (y and z are the same law; hats are estimates, d_hat that of ``disturbance_observer``):

    e_7        = x_7 - x_7d                                                  position error, m       (18)
    x_8d       = x_7d' - xi_7 e_7 - k_7 Gamma_7                              virtual velocity, m/s   (23)
    e_8        = x_8 - x_8d                                                  velocity error, m/s     (25)
    U_x        = x_7d'' + (xi_7^2 - 1 - k_7) e_7 - (xi_7 + xi_hat_8) e_8
                 - a_7 x_8 + xi_7 k_7 Gamma_7 - d_hat                        acceleration, m/s^2     (30)
    Gamma_7'   = e_7                                                         integral, m s           (21)
    xi_hat_8'  = alpha_8 e_8^2                                               adaptive gain, 1/s      (37)
    F_T        = m |U + g e_z|, and the attitude that points it              thrust, N               (38)

Added: bounds on the virtual velocity (``speed_limit``), on acceleration, thrust and tilt (``setpoint``), on Gamma and
xi_hat, a leak of xi_hat. Integral and gain move by forward Euler after the values *before* the step were used
throughout. ``backstepping`` is the law of one axis, ``setpoint`` what all laws share.
Why parameters leave Table 2: docs/explanation/additions.md.
"""

from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, body_z, euler_from_quaternion
from quad_core.parameters import Choice, Value
from quad_core.types import AttitudeThrust, PositionInputs, PositionInternals, Vec3
from quad_core.vehicle import DragSign, Vehicle
from quad_position_ctrl.backstepping import (
    Axes,
    AxisCommand,
    AxisGains,
    axis_command,
    axis_states,
    correction_velocity,
    next_integral,
    updated_gain,
)
from quad_position_ctrl.disturbance_observer import ObservedStep, Observer, estimate
from quad_position_ctrl.setpoint import (
    AntiWindup,
    FeedForward,
    LiftLimits,
    ThrustForm,
    TiltHeading,
    attitude_setpoint,
    desired_angles,
    drag_model,
    integrals_frozen,
    internals_of,
    thrust_command,
)
from quad_position_ctrl.speed_limit import BoundedCorrection, SpeedLimits, bounded_correction

Internals = PositionInternals


class Parameters(NamedTuple):
    """Parameters of AIBS; the defaults are the preset ``tuned``."""

    x: AxisGains = AxisGains()
    y: AxisGains = AxisGains()
    z: AxisGains = AxisGains()
    drag_sign: Annotated[
        int,
        Choice(DragSign, "sign of the drag terms: `corrected` (drag opposes motion) or `printed`", "eqs. 5, 17, 30"),
    ] = DragSign.CORRECTED.value
    thrust_form: Annotated[
        int, Choice(ThrustForm, "norm: F_T as printed; projected: on the actual thrust axis", "Eq. 38")
    ] = ThrustForm.PROJECTED.value
    tilt_heading: Annotated[
        int, Choice(TiltHeading, "yaw of the tilt's frame; reference: psi_d; measured: the vehicle's", "Eq. 38")
    ] = TiltHeading.MEASURED.value
    anti_windup: AntiWindup = True
    speed: SpeedLimits = SpeedLimits()
    limits: LiftLimits = LiftLimits()
    observer: Observer = Observer()
    feed_forward: FeedForward = False


class Memory(NamedTuple):
    """What AIBS keeps from step to step: Gamma, xi_hat, and what the disturbance estimate compares with.

    ``error_integral`` m s, ``adaptive_gain`` 1/s, ``disturbance_estimate`` m/s^2, ``velocity`` m/s and ``thrust_axis``
    (body z in the world) of the last step, ``initialised``: there was one.
    """

    error_integral: Vec3 = Vec3()
    adaptive_gain: Vec3 = Vec3()
    disturbance_estimate: Vec3 = Vec3()
    velocity: Vec3 = Vec3()
    thrust_axis: Vec3 = Vec3()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: Gamma = 0, xi_hat = xi_hat(0)."""
    gain = Vec3(parameters.x.initial_gain, parameters.y.initial_gain, parameters.z.initial_gain)
    return Memory(ZERO, gain, ZERO, ZERO, ZERO, False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s (eqs. 18-38). Raises nothing on flyable inputs."""
    state, reference = inputs.state, inputs.reference
    thrust_axis = body_z(state.q_wb)
    drag = drag_model(vehicle, parameters.drag_sign)
    disturbance = memory.disturbance_estimate
    if memory.initialised:  # in the first step there is nothing to compare with
        observed = ObservedStep(memory.velocity, state.v_w, memory.thrust_axis, thrust_axis, inputs.actuation.thrust)
        disturbance = estimate(parameters.observer, vehicle, disturbance, observed, drag, dt)
    axes = axis_states(state, reference)
    gain, integral = memory.adaptive_gain, memory.error_integral
    correction = _correction(parameters, axes, integral)
    x = axis_command(parameters.x, axes[0], correction.x, gain.x, integral.x, drag, disturbance.x)
    y = axis_command(parameters.y, axes[1], correction.y, gain.y, integral.y, drag, disturbance.y)
    z = axis_command(parameters.z, axes[2], correction.z, gain.z, integral.z, drag, disturbance.z)

    command = Vec3(x.acceleration, y.acceleration, z.acceleration)
    thrust = thrust_command(command, vehicle, parameters.limits, thrust_axis, parameters.thrust_form)
    heading = reference.yaw
    if parameters.tilt_heading != TiltHeading.REFERENCE:
        heading = euler_from_quaternion(state.q_wb).z
    angles = desired_angles(thrust.lift.lift, heading, reference.yaw)
    setpoint = attitude_setpoint(vehicle, reference, angles, thrust.thrust, heading, parameters.feed_forward)

    frozen = integrals_frozen(parameters.anti_windup, correction, thrust, inputs.actuation)
    next_integrals, next_gains = integral, gain
    if not frozen:
        next_integrals, next_gains = _adapted(parameters, memory, x, y, z, dt)
    next_memory = Memory(next_integrals, next_gains, disturbance, state.v_w, thrust_axis, True)
    internals = internals_of(
        Vec3(x.error, y.error, z.error),
        Vec3(x.velocity_error, y.velocity_error, z.velocity_error),
        Vec3(x.virtual_velocity, y.virtual_velocity, z.virtual_velocity),
        command,
        disturbance,
        correction,
        thrust,
        frozen,
        integral,
        gain,
        x.lyapunov + y.lyapunov + z.lyapunov,
        x.lyapunov_rate + y.lyapunov_rate + z.lyapunov_rate,
    )
    return setpoint, next_memory, internals


def _correction(parameters: Parameters, axes: Axes, integral: Vec3) -> BoundedCorrection:
    """Return the bounded correction of Eq. 23: by its length in the horizontal plane, by its size along z.

    Its derivative counts Gamma (``integral``, m s) as resting, which it does wherever the bound is met and the
    derivative used.
    """
    x, y, z = axes
    gains_x, gains_y, gains_z = parameters.x, parameters.y, parameters.z
    gain_x, gain_y, gain_z = gains_x.position_gain, gains_y.position_gain, gains_z.position_gain
    velocity = Vec3(
        correction_velocity(gain_x, gains_x.integral_gain, x.position - x.reference_position, integral.x),
        correction_velocity(gain_y, gains_y.integral_gain, y.position - y.reference_position, integral.y),
        correction_velocity(gain_z, gains_z.integral_gain, z.position - z.reference_position, integral.z),
    )
    rate = Vec3(
        -gain_x * (x.velocity - x.reference_velocity),
        -gain_y * (y.velocity - y.reference_velocity),
        -gain_z * (z.velocity - z.reference_velocity),
    )
    gain_xy = gain_y if gain_y > gain_x else gain_x
    return bounded_correction(velocity, rate, gain_xy, gain_z, parameters.speed)


def _adapted(
    parameters: Parameters, memory: Memory, x: AxisCommand, y: AxisCommand, z: AxisCommand, dt: float
) -> tuple[Vec3, Vec3]:
    """Return Gamma in m s (Eq. 21) and xi_hat in 1/s (Eq. 37) after the step."""
    integral, gain = memory.error_integral, memory.adaptive_gain
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
"""What of the additions is enough to fly the paper's cases from its initial condition (docs/results/as_printed.md)."""

PRESETS: dict[str, dict[str, Value]] = {
    "tuned": {},
    "minimal": {name: value for name, value in _PRINTED.items() if not name.startswith(_SMALLEST_SET)},
    "printed": _PRINTED,
}
