"""A position law of your own: proportional and derivative, thrust along the acceleration command.

    a = -k_p (p - p_d) - k_d (v - v_d) + a_d,    F_T = m (g + a_z),    phi_d = (a_x sin psi - a_y cos psi) / g,
    theta_d = (a_x cos psi + a_y sin psi) / g

Fly it: scripts/fly case1 --position my_law --set position_controller.my_law.stiffness=3
"""

import math
from typing import Annotated, NamedTuple

from quad_core.geometry import quaternion_from_euler
from quad_core.parameters import Real
from quad_core.types import AttitudeThrust, PositionInputs, Vec3
from quad_core.vehicle import Vehicle, max_thrust


class Parameters(NamedTuple):
    """Gains; from here come the ROS parameters, the check of YAML files and what may vary in a campaign."""

    stiffness: Annotated[float, Real("1/s^2", "k_p: pull towards the reference", 0.1, 50.0)] = 4.0
    damping: Annotated[float, Real("1/s", "k_d: pull towards its velocity", 0.1, 50.0)] = 3.0


class Memory(NamedTuple):
    """What the law remembers from step to step: here only how often it was asked."""

    steps: int = 0


class Internals(NamedTuple):
    """What the bag shows of each step: fields of quad_core.types.PositionInternals, and the law's own in ``extra``."""

    position_error: Vec3 = Vec3()
    steps: int = 0


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:
    """Return the memory before the first step."""
    return Memory(0)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return attitude and thrust for the next ``dt`` s, the memory and what the bag shows."""
    p, v = inputs.state.p_w, inputs.state.v_w
    goal = inputs.reference
    error = Vec3(p.x - goal.p_w.x, p.y - goal.p_w.y, p.z - goal.p_w.z)
    ax = goal.a_w.x - parameters.stiffness * error.x - parameters.damping * (v.x - goal.v_w.x)
    ay = goal.a_w.y - parameters.stiffness * error.y - parameters.damping * (v.y - goal.v_w.y)
    az = goal.a_w.z - parameters.stiffness * error.z - parameters.damping * (v.z - goal.v_w.z)
    g = vehicle.gravity
    sin_yaw, cos_yaw = math.sin(goal.yaw), math.cos(goal.yaw)
    roll = limited((ax * sin_yaw - ay * cos_yaw) / g, 0.5)
    pitch = limited((ax * cos_yaw + ay * sin_yaw) / g, 0.5)
    largest = max_thrust(vehicle)
    thrust = limited(vehicle.mass * (g + az), largest)
    if thrust < 0.05 * largest:
        thrust = 0.05 * largest
    angles = Vec3(roll, pitch, goal.yaw)
    zero = Vec3(0.0, 0.0, 0.0)
    setpoint = AttitudeThrust(angles, zero, zero, quaternion_from_euler(angles), thrust, thrust / largest)
    return setpoint, Memory(memory.steps + 1), Internals(error, memory.steps)


def limited(value: float, limit: float) -> float:
    """Return ``value`` within -limit to limit."""
    if value > limit:
        return limit
    if value < -limit:
        return -limit
    return value
