"""An attitude law of your own: proportional and derivative on each axis, small angles.

    tau = -I (k_p (angles - angles_d) + k_d omega_b),    F_T as the position law asks

Fly it: scripts/fly case1 --attitude my_attitude_law --set attitude_controller.my_attitude_law.stiffness=300
"""

from typing import Annotated, NamedTuple

from quad_core.geometry import euler_from_quaternion, wrap_angle
from quad_core.parameters import Real
from quad_core.types import AttitudeInputs, Vec3, Wrench
from quad_core.vehicle import Vehicle


class Parameters(NamedTuple):
    """Gains, the same for the three axes."""

    stiffness: Annotated[float, Real("1/s^2", "k_p: pull towards the commanded angles", 1.0, 5000.0)] = 200.0
    damping: Annotated[float, Real("1/s", "k_d: pull towards rest", 0.1, 500.0)] = 25.0


class Memory(NamedTuple):
    """What the law remembers from step to step: here only how often it was asked."""

    steps: int = 0


class Internals(NamedTuple):
    """What the bag shows of each step: fields of quad_core.types.AttitudeInternals, and the law's own in ``extra``."""

    angle_error: Vec3 = Vec3()
    steps: int = 0


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:
    """Return the memory before the first step."""
    return Memory(0)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return thrust and torque for the next ``dt`` s, the memory and what the bag shows."""
    angles = euler_from_quaternion(inputs.state.q_wb)
    goal, omega = inputs.setpoint.angles, inputs.state.omega_b
    error = Vec3(angles.x - goal.x, angles.y - goal.y, wrap_angle(angles.z - goal.z))
    stiffness, damping = parameters.stiffness, parameters.damping
    torque = Vec3(
        -vehicle.inertia_xx * (stiffness * error.x + damping * omega.x),
        -vehicle.inertia_yy * (stiffness * error.y + damping * omega.y),
        -vehicle.inertia_zz * (stiffness * error.z + damping * omega.z),
    )
    return Wrench(inputs.setpoint.thrust, torque), Memory(memory.steps + 1), Internals(error, memory.steps)
