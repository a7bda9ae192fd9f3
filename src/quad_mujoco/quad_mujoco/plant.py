"""Plant ``mujoco``: the vehicle of ``rigid_body`` integrated by MuJoCo (RK4), behind the same plug-in contract.

It takes parameter errors (Eq. 10), outer force and torque and wind on the linear drag. It has ideal rotors without a
time constant, no payload, rotor faults, battery or ground: those belong to ``rigid_body``. Drag torque (Eq. 9) is held
over a step. It is not made for Numba: it flies over ROS and in the Python loop.
"""

from quad_core.types import Actuation, Conditions, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.allocation import allocate
from quad_dynamics.parameters import DRAG_PRINTED, PlantParameters
from quad_dynamics.rigid_body import State, lumped, observe
from quad_dynamics.uncertainty import true_body, true_thrust, true_torque
from quad_mujoco.model import Motion, free_body

__all__ = ["Parameters", "State", "init", "lumped", "observe", "step"]

Parameters = PlantParameters


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return the state at step 0.

    Raises ValueError if mass or inertia, errors included, are not physical, or drag is to be as printed.
    """
    if parameters.drag_sign == DRAG_PRINTED:
        raise ValueError("mujoco.drag_sign: found 'printed', expected 'corrected': MuJoCo's damping only slows down")
    start = rigid_body.init(parameters, vehicle)
    free_body(true_body(parameters, vehicle), 1e-3)
    return start


def step(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions, dt: float
) -> tuple[State, Actuation]:
    """Return the state ``dt`` s later under a constant ``wrench`` and constant ``conditions``, and the actuation.

    Overflow shows in the state: MuJoCo's own reset of an unstable one is switched off.
    """
    actuation = allocate(vehicle, wrench)
    body = true_body(parameters, vehicle)
    outer, wind, drag = conditions.force_w, conditions.wind_w, body.drag_coefficient
    force = (outer.x + drag * wind.x, outer.y + drag * wind.y, outer.z + drag * wind.z)
    motion = Motion(
        (state.px, state.py, state.pz),
        (state.vx, state.vy, state.vz),
        (state.qx, state.qy, state.qz, state.qw),
        (state.wx, state.wy, state.wz),
    )
    moved = free_body(body, dt / parameters.substeps).moved(
        motion,
        true_thrust(parameters, actuation),
        true_torque(parameters, actuation, conditions.torque_b),
        force,
        parameters.substeps,
    )
    return State(*moved.p, *moved.v, *moved.q, *moved.omega), actuation
