"""Position part of geometric tracking control on SE(3), a ``quad.position_law`` plug-in.

Source: Lee, Leok and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010, position mode:
F = m (-k_x e_x - k_v e_v + g e_3 + a_d), thrust f = F . R e_3, desired axes b_3 = F/|F|, b_2 = b_3 x b_1d / |..|,
b_1 = b_2 x b_3. Written for a world with z up; gains are divided by the mass. It has no integral, as in the source.
Added: the limits of AIBS, k_x e_x bounded as its virtual velocity is. The rates that the source derives from b_3 are
left to the attitude law's command filter.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_core.rotations import body_z
from quad_core.types import AttitudeThrust, PositionInputs, Vec3
from quad_core.vehicle import Vehicle
from quad_position_ctrl.aibs import Internals
from quad_position_ctrl.cascade import approach, difference, plain_internals, reach, setpoint
from quad_position_ctrl.speed_limit import SpeedLimits
from quad_position_ctrl.thrust_vector import Limits, clamped


class Gains(NamedTuple):
    """Gains of one direction."""

    position: Annotated[float, Real("1/s^2", "k_x / m", 0.01, 1e4, "Lee 2010")] = 16.0
    velocity: Annotated[float, Real("1/s", "k_v / m", 0.01, 1e3, "Lee 2010")] = 6.0


class Parameters(NamedTuple):
    """Parameters of the position part."""

    xy: Gains = Gains()
    z: Gains = Gains()
    speed: SpeedLimits = SpeedLimits()
    limits: Limits = Limits()


class Memory(NamedTuple):
    """The law keeps nothing; Numba wants a field."""

    steps: float = 0.0


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step."""
    return Memory(0.0)


def step(
    parameters: Parameters,
    vehicle: Vehicle,
    memory: Memory,
    inputs: PositionInputs,
    dt: float,  # noqa: ARG001 (the law has no dynamics)
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step. Raises nothing on flyable inputs."""
    state, reference = inputs.state, inputs.reference
    xy, z = parameters.xy, parameters.z
    error = difference(state.p_w, reference.p_w)
    error_v = difference(state.v_w, reference.v_w)
    # k_x e_x = k_v (k_x/k_v e_x): the inner factor is a velocity, bounded like the others'
    wanted = approach(xy.position / xy.velocity, z.position / z.velocity, error, parameters.speed)
    command = Vec3(
        reference.a_w.x + xy.velocity * (wanted.velocity.x - error_v.x),
        reference.a_w.y + xy.velocity * (wanted.velocity.y - error_v.y),
        reference.a_w.z + z.velocity * (wanted.velocity.z - error_v.z),
    )
    reached = reach(command, vehicle, parameters.limits, body_z(state.q_wb))
    angles = desired_attitude(reached.limits.lift, reference.yaw)
    answer = setpoint(vehicle, reference, angles, reached.thrust)
    v_d = Vec3(
        reference.v_w.x + wanted.velocity.x, reference.v_w.y + wanted.velocity.y, reference.v_w.z + wanted.velocity.z
    )
    none = Vec3(0.0, 0.0, 0.0)
    internals = plain_internals(error, error_v, v_d, command, none, wanted, reached, False)
    return answer, Memory(memory.steps + 1.0), internals


def desired_attitude(lift: Vec3, yaw: float) -> Vec3:
    """Return (phi, theta, psi) in rad of Lee's desired axes for ``lift`` (m/s^2, world) and heading ``yaw`` in rad.

    The heading vector is projected on the plane normal to the thrust, so that psi differs a little from ``yaw`` when
    tilted to the side. A lift of no length, or one along the heading vector, counts as upright.
    """
    length = math.sqrt(lift.x * lift.x + lift.y * lift.y + lift.z * lift.z)
    if length < 1e-9:
        return Vec3(0.0, 0.0, yaw)
    x3, y3, z3 = lift.x / length, lift.y / length, lift.z / length
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    x2, y2, z2 = -z3 * sin_yaw, z3 * cos_yaw, x3 * sin_yaw - y3 * cos_yaw
    across = math.sqrt(x2 * x2 + y2 * y2 + z2 * z2)
    if across < 1e-9:
        return Vec3(0.0, 0.0, yaw)
    x2, y2, z2 = x2 / across, y2 / across, z2 / across
    x1, y1, z1 = y2 * z3 - z2 * y3, z2 * x3 - x2 * z3, x2 * y3 - y2 * x3
    return Vec3(math.atan2(z2, z3), -math.asin(clamped(z1, -1.0, 1.0)), math.atan2(y1, x1))
