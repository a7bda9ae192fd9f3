"""A position law of your own: proportional and derivative.

    a = a_d - k_p (p - p_d) - k_d (v - v_d)

``pointed`` makes attitude and thrust of an acceleration and the yaw of the reference: m (a + g e_z) along the body's z,
within ``limits``. A law may also build its AttitudeThrust by itself.

Fly it: scripts/fly case1 --position my_law --set position_controller.my_law.stiffness=3
"""

from typing import Annotated, NamedTuple

from quad_core.geometry import add, scale, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeThrust, PositionInputs, Vec3
from quad_core.vehicle import Vehicle
from quad_position_ctrl.se3 import pointed
from quad_position_ctrl.setpoint import LiftLimits


class Parameters(NamedTuple):
    """Gains; from here come the ROS parameters, the check of YAML files and what may vary in a campaign."""

    stiffness: Annotated[float, Real("1/s^2", "k_p: pull towards the reference", 0.1, 50.0)] = 4.0
    damping: Annotated[float, Real("1/s", "k_d: pull towards its velocity", 0.1, 50.0)] = 3.0
    limits: LiftLimits = LiftLimits()


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
    state, goal = inputs.state, inputs.reference
    error = subtract(state.p_w, goal.p_w)
    pull = scale(-parameters.stiffness, error)
    brake = scale(-parameters.damping, subtract(state.v_w, goal.v_w))
    acceleration = add(goal.a_w, add(pull, brake))
    _, setpoint = pointed(parameters.limits, False, vehicle, inputs, acceleration)
    return setpoint, Memory(memory.steps + 1), Internals(error, memory.steps)
