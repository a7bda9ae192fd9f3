"""Attitude part of geometric tracking control on SE(3), a ``quad.attitude_law`` plug-in.

    e_R     = 1/2 (R_d^T R - R^T R_d)^vee                      attitude error: rotation axis times sine of the angle
    e_Omega = Omega - R^T R_d Omega_d                          rate error, rad/s
    M       = -k_R e_R - k_Omega e_Omega + Omega x J Omega
              - J (Omega^ R^T R_d Omega_d - R^T R_d Omega_d')  torque, N m

Source: Lee, Leok and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010. On quaternions: with
q = q_d^-1 q_wb, e_R = 2 q_w (q_x, q_y, q_z). Gains are per axis and divided by the inertia. Omega_d and its derivative
come from the command filter. It has no integral, as in the source.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.command import FilterStates, Shaping, desired, filters_at_rest, next_filters
from quad_attitude_ctrl.torque import TorqueLimits, body_acceleration, limited_torque, plain_internals
from quad_core.geometry import (
    ZERO,
    body_rates,
    cross,
    euler_from_quaternion,
    quaternion_from_euler,
    relative_attitude,
    rotate_inverse,
    subtract,
)
from quad_core.parameters import Real
from quad_core.types import AttitudeInputs, AttitudeInternals, AxisFlags, Quat, Vec3, Wrench
from quad_core.vehicle import Vehicle

Internals = AttitudeInternals


class Gains(NamedTuple):
    """Gains of one body axis."""

    angle: Annotated[float, Real("1/s^2", "k_R / J", 0.0, 1e5, "Lee 2010")] = 300.0
    rate: Annotated[float, Real("1/s", "k_Omega / J", 0.0, 1e4, "Lee 2010")] = 30.0


class Parameters(NamedTuple):
    """Parameters of the attitude part."""

    roll: Gains = Gains()
    pitch: Gains = Gains()
    yaw: Gains = Gains()
    shaping: Shaping = Shaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filters; ``initialised``: they started at an attitude."""

    filters: FilterStates = FilterStates()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step."""
    return Memory(filters=filters_at_rest(ZERO), initialised=False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    In the internals ``angle_error`` is e_R, ``rate_error`` e_Omega, ``reaching_control`` the feedback and
    ``equivalent_control`` the rest of M / J, in rad/s^2.
    """
    state = inputs.state
    omega_b = state.omega_b
    filters = memory.filters
    if not memory.initialised:
        filters = filters_at_rest(euler_from_quaternion(state.q_wb))
    goal = desired(parameters.shaping.command, filters, inputs.setpoint)
    relative = relative_attitude(quaternion_from_euler(goal.angles), state.q_wb)
    error = rotation_error(relative)
    turned_rates = rotate_inverse(relative, body_rates(goal.angles, goal.rates))
    turned = rotate_inverse(relative, body_acceleration(goal.angles, goal.rates, goal.accelerations))
    error_rate = subtract(omega_b, turned_rates)

    feedback = Vec3(
        -parameters.roll.angle * error.x - parameters.roll.rate * error_rate.x,
        -parameters.pitch.angle * error.y - parameters.pitch.rate * error_rate.y,
        -parameters.yaw.angle * error.z - parameters.yaw.rate * error_rate.z,
    )
    carried = cross(omega_b, turned_rates)
    gyroscopic = cross(
        omega_b,
        Vec3(vehicle.inertia_xx * omega_b.x, vehicle.inertia_yy * omega_b.y, vehicle.inertia_zz * omega_b.z),
    )
    remainder = Vec3(
        turned.x - carried.x + gyroscopic.x / vehicle.inertia_xx,
        turned.y - carried.y + gyroscopic.y / vehicle.inertia_yy,
        turned.z - carried.z + gyroscopic.z / vehicle.inertia_zz,
    )
    torque_command = Vec3(
        vehicle.inertia_xx * (feedback.x + remainder.x),
        vehicle.inertia_yy * (feedback.y + remainder.y),
        vehicle.inertia_zz * (feedback.z + remainder.z),
    )
    torque = limited_torque(torque_command, parameters.torque)
    shaping = parameters.shaping
    next_states = next_filters(shaping.command, filters, inputs.setpoint, shaping.roll, shaping.pitch, shaping.yaw, dt)
    internals = plain_internals(
        goal=goal,
        angle_error=error,
        rate_error=error_rate,
        feed_forward=remainder,
        feedback=feedback,
        torque=torque,
        frozen=AxisFlags(False, False, False),
    )
    return Wrench(inputs.setpoint.thrust, torque.torque), Memory(filters=next_states, initialised=True), internals


def rotation_error(relative: Quat) -> Vec3:
    """Return e_R = 1/2 (R_e - R_e^T)^vee of R_e = R_d^T R: the rotation axis times the sine of the angle."""
    return Vec3(2.0 * relative.w * relative.x, 2.0 * relative.w * relative.y, 2.0 * relative.w * relative.z)
