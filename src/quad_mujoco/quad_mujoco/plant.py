"""Plant ``mujoco``: the vehicle of ``rigid_body`` integrated by MuJoCo (RK4), behind the same plug-in contract.

It takes parameter errors (Eq. 10), outer force and torque, wind on the linear drag, rotors that fail, battery, and mass
and moments of inertia of a payload. Rotors that lag have their middle speed over a whole plant period. It has no lever
of a payload, no rotor-induced drag and no tau_G: those belong to ``rigid_body``. The ground is MuJoCo's own contact of
a plane and four feet, stiff and sticky as its defaults are. Drag torque (Eq. 9) is held over a step. It is not made for
Numba: it flies over ROS and in the Python loop.
"""

import math

from quad_core.geometry import add, scale
from quad_core.types import NO_PAYLOAD, Actuation, Conditions, Vec3, Wrench
from quad_core.vehicle import DragSign, Layout, Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.newton_euler import true_body
from quad_dynamics.parameters import Ground, PlantParameters
from quad_dynamics.rigid_body import State, lumped, observe
from quad_dynamics.rotors import (
    allocate_within,
    decay,
    is_lagging,
    max_rotor_thrust,
    reached,
    rotor_lag,
    rotor_thrusts,
    rotor_wrench,
)
from quad_mujoco.model import Floor, free_body

__all__ = ["Parameters", "State", "init", "lumped", "observe", "step"]

Parameters = PlantParameters
COMPILES = False


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return the state at step 0.

    Raises ValueError if mass or inertia, errors included, are not physical, or printed drag is asked for.
    """
    if parameters.drag_sign == DragSign.PRINTED:
        raise ValueError("mujoco.drag_sign: found 'printed', expected 'corrected': MuJoCo's damping only slows down")
    start = rigid_body.init(parameters, vehicle)
    free_body(true_body(parameters, vehicle, NO_PAYLOAD), 1e-3)
    return start


def floor(ground: Ground, vehicle: Vehicle) -> Floor | None:
    """Return the ground under the feet of ``vehicle``, or None."""
    if not ground.enabled:
        return None
    first, arm = 0.25 * math.pi if vehicle.layout == Layout.X else 0.0, vehicle.arm_length
    directions = (first + 0.5 * math.pi * i for i in range(4))  # one foot below each rotor
    feet = (Vec3(arm * math.cos(turn), arm * math.sin(turn), -ground.foot_depth) for turn in directions)
    return Floor(ground.height, ground.friction, tuple(feet))


def step(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions, dt: float
) -> tuple[State, Actuation]:
    """Return the state ``dt`` s later under a constant ``wrench`` and constant ``conditions``, and the actuation.

    Overflow shows in the state: MuJoCo's own reset of an unstable one is switched off.
    """
    actuation = allocate_within(vehicle, wrench, max_rotor_thrust(vehicle, conditions))
    body = true_body(parameters, vehicle, conditions.payload)
    commanded = actuation.rotor_speed
    speeds = middle = commanded
    thrusts = actuation.rotor_thrust
    if is_lagging(vehicle):
        half_decay = decay(vehicle, 0.5 * dt)
        middle = rotor_lag(state.rotor_speed, commanded, half_decay)
        speeds = rotor_lag(state.rotor_speed, commanded, half_decay * half_decay)
        thrusts = rotor_thrusts(vehicle, middle)
        actuation = reached(vehicle, actuation, speeds)
    rotors = rotor_wrench(
        vehicle,
        parameters.effectiveness,
        conditions.rotor_effectiveness,
        thrusts=thrusts,
        speeds=middle,
        commanded=commanded,
    )
    force_w = add(conditions.force_w, scale(body.drag_coefficient, conditions.wind_w))
    motion = free_body(body, dt / parameters.substeps, floor(parameters.ground, vehicle)).moved(
        state.motion, rotors.thrust, add(rotors.torque_b, conditions.torque_b), force_w, parameters.substeps
    )
    return State(motion, speeds), actuation
