"""Attitude part of geometric tracking control on SE(3), a ``quad.attitude_law`` plug-in.

    e_R     = 1/2 (R_d^T R - R^T R_d)^vee                      attitude error: rotation axis times sine of the angle
    e_Omega = Omega - R^T R_d Omega_d                          rate error, rad/s
    M       = -k_R e_R - k_Omega e_Omega + Omega x J Omega
              - J (Omega^ R^T R_d Omega_d - R^T R_d Omega_d')  torque, N m

Source: Lee, Leok and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010. The errors and their
feedback are those of ``geometric``. It has no integral, as in the source.
"""

from typing import NamedTuple

from quad_attitude_ctrl.geometric import Gains, presets, tracking
from quad_attitude_ctrl.rotation_filter import (
    NO_ROTATION,
    RotationShaping,
    RotationState,
    as_angles,
    filter_and_goal,
    next_rotation,
)
from quad_attitude_ctrl.torque import TorqueLimits, internals_of, limited_torque, torque_for
from quad_core.geometry import add, cross
from quad_core.types import AttitudeInputs, AttitudeInternals, AxisFlags, Vec3, Wrench
from quad_core.vehicle import Vehicle

Internals = AttitudeInternals


class Parameters(NamedTuple):
    """Parameters of the attitude part."""

    roll: Gains = Gains()
    pitch: Gains = Gains()
    yaw: Gains = Gains()
    shaping: RotationShaping = RotationShaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filter; ``initialised``: they started at an attitude."""

    filter: RotationState = RotationState()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step."""
    return Memory(filter=NO_ROTATION, initialised=False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    In the internals ``angle_error`` is e_R, ``rate_error`` e_Omega, ``reaching_control`` the feedback and
    ``equivalent_control`` the rest of M / J, in rad/s^2.
    """
    state = inputs.state
    omega_b = state.omega_b
    shaping, setpoint = parameters.shaping, inputs.setpoint
    filtered, goal = filter_and_goal(shaping, memory.filter, memory.initialised, state.q_wb, setpoint)
    found = tracking(goal, state, parameters.roll, parameters.pitch, parameters.yaw)
    feedback, feed_forward = found.feedback, found.feed_forward
    gyroscopic = cross(omega_b, torque_for(vehicle, omega_b))
    remainder = Vec3(
        feed_forward.x + gyroscopic.x / vehicle.inertia_xx,
        feed_forward.y + gyroscopic.y / vehicle.inertia_yy,
        feed_forward.z + gyroscopic.z / vehicle.inertia_zz,
    )
    torque = limited_torque(torque_for(vehicle, add(feedback, remainder)), parameters.torque)
    next_filter = next_rotation(parameters.shaping, filtered, inputs.setpoint, dt)
    rest = AxisFlags(False, False, False)
    internals = internals_of(as_angles(goal), found.angle_error, found.rate_error, remainder, feedback, torque, rest)
    return Wrench(inputs.setpoint.thrust, torque.torque), Memory(filter=next_filter, initialised=True), internals


PRESETS = presets({"angle": 220.0, "rate": 22.0})
