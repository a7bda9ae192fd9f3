"""Plant ``mujoco``: the vehicle of ``rigid_body`` integrated by MuJoCo (RK4), behind the same plug-in contract.

It takes parameter errors (Eq. 10), outer force and torque, wind on the linear drag, rotors that fail, battery, and mass
and moments of inertia of a payload. Rotors that lag have their middle speed over a whole plant period. It has no lever
of a payload, no rotor-induced drag, no tau_G and no ground: those belong to ``rigid_body``. Drag torque (Eq. 9) is held
over a step. It is not made for Numba: it flies over ROS and in the Python loop.
"""

from quad_core.types import NO_PAYLOAD, Actuation, Conditions, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.allocation import allocate_within
from quad_dynamics.parameters import DRAG_PRINTED, PlantParameters
from quad_dynamics.rigid_body import State, lumped, observe
from quad_dynamics.rotor_dynamics import (
    each,
    follow,
    is_lagging,
    most_thrust,
    reported,
    share_left,
    thrusts_of,
    true_push,
)
from quad_dynamics.uncertainty import true_body
from quad_mujoco.model import Motion, free_body

__all__ = ["Parameters", "State", "init", "lumped", "observe", "step"]

Parameters = PlantParameters
COMPILES = False


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return the state at step 0.

    Raises ValueError if mass or inertia, errors included, are not physical, or printed drag or a ground is asked for.
    """
    if parameters.drag_sign == DRAG_PRINTED:
        raise ValueError("mujoco.drag_sign: found 'printed', expected 'corrected': MuJoCo's damping only slows down")
    if parameters.ground.enabled:
        raise ValueError("mujoco.ground.enabled: found true, expected false: this plant has no ground")
    start = rigid_body.init(parameters, vehicle)
    free_body(true_body(parameters, vehicle, NO_PAYLOAD), 1e-3)
    return start


def step(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions, dt: float
) -> tuple[State, Actuation]:
    """Return the state ``dt`` s later under a constant ``wrench`` and constant ``conditions``, and the actuation.

    Overflow shows in the state: MuJoCo's own reset of an unstable one is switched off.
    """
    actuation = allocate_within(vehicle, wrench, most_thrust(vehicle, conditions))
    body = true_body(parameters, vehicle, conditions.payload)
    wanted = each(actuation.rotor_speed)
    lagging = is_lagging(vehicle)
    turning = (state.r1, state.r2, state.r3, state.r4)
    left = share_left(vehicle, 0.5 * dt) if lagging else 0.0
    speeds, middle = follow(turning, wanted, left * left), follow(turning, wanted, left)
    thrusts = thrusts_of(vehicle, middle) if lagging else each(actuation.rotor_thrust)
    push = true_push(vehicle, parameters.effectiveness, conditions.rotor_effectiveness, thrusts, middle, wanted)
    torque = conditions.torque_b
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
        push.thrust,
        (push.torque_b[0] + torque.x, push.torque_b[1] + torque.y, push.torque_b[2] + torque.z),
        force,
        parameters.substeps,
    )
    if lagging:
        actuation = reported(vehicle, actuation, speeds, thrusts_of(vehicle, speeds))
    return State(*moved.p, *moved.v, *moved.q, *moved.omega, *speeds), actuation
