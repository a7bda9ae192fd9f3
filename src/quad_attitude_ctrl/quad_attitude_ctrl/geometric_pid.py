"""Geometric PID, attitude part: tracking on SO(3) with an integral, a ``quad.attitude_law`` plug-in.

    e_I'    = e_Omega + c e_R                                                       integral, rad
    w_d     = R^T R_d Omega_d                                                       rad/s
    M       = -k_R e_R - k_Omega e_Omega - k_I e_I + w_d x J w_d + J R^T R_d Omega_d'    torque, N m

Source: Goodarzi, Lee and Lee, Geometric nonlinear PID control of a quadrotor UAV on SE(3), ECC 2013, attitude mode. e_R
and e_Omega are those of ``geometric``. Gains are divided by the inertia. Added: the integral is bounded and rests on an
axis while its torque is limited.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.geometric import Gains as ErrorGains
from quad_attitude_ctrl.geometric import presets, tracking
from quad_attitude_ctrl.rotation_filter import (
    NO_ROTATION,
    RotationShaping,
    RotationState,
    as_angles,
    filter_and_goal,
    next_rotation,
)
from quad_attitude_ctrl.torque import (
    AntiWindup,
    TorqueLimits,
    integrals_frozen,
    internals_of,
    limited_torque,
    torque_for,
)
from quad_core.geometry import ZERO, add, clamp, cross, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeInputs, AttitudeInternals, Vec3, Wrench
from quad_core.vehicle import Vehicle

Internals = AttitudeInternals


class Gains(NamedTuple):
    """Gains of one body axis."""

    angle: Annotated[float, Real("1/s^2", "attitude gain k_R / J; larger: stiffer", 0.0, 1e5)] = 250.0
    rate: Annotated[float, Real("1/s", "rate gain k_Omega / J; larger: more damped", 0.0, 1e4)] = 35.0
    integral: Annotated[float, Real("1/s^2", "integral gain k_I / J; larger: offsets go faster; 0: off", 0.0, 1e5)] = (
        200.0
    )
    mixing: Annotated[float, Real("1/s", "share c of e_R in the integral; larger: offsets go faster", 0.0, 1e3)] = 5.0
    max_integral: Annotated[float, Real("rad", "bound of e_I", 0.0, 1e3)] = 0.1


class Parameters(NamedTuple):
    """Parameters of the attitude part."""

    roll: Gains = Gains()
    pitch: Gains = Gains()
    yaw: Gains = Gains()
    anti_windup: AntiWindup = True
    shaping: RotationShaping = RotationShaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filter, and the integral e_I in rad; ``initialised``: the filter started at an attitude."""

    filter: RotationState = RotationState()
    integral: Vec3 = Vec3()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no integral."""
    return Memory(filter=NO_ROTATION, integral=ZERO, initialised=False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    In the internals ``angle_error`` is e_R, ``rate_error`` e_Omega, ``surface_integral`` e_I in rad,
    ``reaching_control`` the feedback and ``equivalent_control`` the rest of M / J, in rad/s^2.
    """
    setpoint, state, old = inputs.setpoint, inputs.state, memory.integral
    roll, pitch, yaw = parameters.roll, parameters.pitch, parameters.yaw
    filtered, goal = filter_and_goal(parameters.shaping, memory.filter, memory.initialised, state.q_wb, setpoint)
    found = tracking(goal, state, _of_errors(roll), _of_errors(pitch), _of_errors(yaw))
    w_d = subtract(state.omega_b, found.rate_error)
    # R^T R_d Omega_d' alone: the source has no Omega x w_d
    turned = add(found.feed_forward, cross(state.omega_b, w_d))
    spin = cross(w_d, torque_for(vehicle, w_d))
    ahead = Vec3(
        turned.x + spin.x / vehicle.inertia_xx,
        turned.y + spin.y / vehicle.inertia_yy,
        turned.z + spin.z / vehicle.inertia_zz,
    )
    part = Vec3(roll.integral * old.x, pitch.integral * old.y, yaw.integral * old.z)
    feedback = subtract(found.feedback, part)
    torque = limited_torque(torque_for(vehicle, add(ahead, feedback)), parameters.torque)
    frozen = integrals_frozen(parameters.anti_windup, torque.limited, inputs.actuation)
    e_r, e_w = found.angle_error, found.rate_error
    integral = Vec3(
        _integrated(roll, old.x, e_r.x, e_w.x, frozen.x, dt),
        _integrated(pitch, old.y, e_r.y, e_w.y, frozen.y, dt),
        _integrated(yaw, old.z, e_r.z, e_w.z, frozen.z, dt),
    )
    next_filter = next_rotation(parameters.shaping, filtered, setpoint, dt)
    internals = internals_of(as_angles(goal), e_r, e_w, ahead, feedback, torque, frozen, ZERO, old)
    return Wrench(setpoint.thrust, torque.torque), Memory(next_filter, integral, True), internals


def _of_errors(gains: Gains) -> ErrorGains:
    return ErrorGains(gains.angle, gains.rate)


def _integrated(gains: Gains, e_i: float, e_r: float, e_w: float, frozen: bool, dt: float) -> float:
    """Return e_I of an axis in rad after a step of ``dt`` s."""
    if frozen:
        return e_i
    return clamp(e_i + dt * (e_w + gains.mixing * e_r), -gains.max_integral, gains.max_integral)


PRESETS = presets({"angle": 220.0, "rate": 25.0})
