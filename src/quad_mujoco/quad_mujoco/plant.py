"""Plant ``mujoco``: the vehicle of ``rigid_body`` integrated by MuJoCo (RK4), behind the same plug-in contract.

It takes parameter errors (Eq. 10), outer force and torque, wind on the linear drag, rotors that fail, battery, and
the mass of a payload. Rotors that lag have their middle speed over a whole plant period. It has no rotor-induced drag
and no tau_G: those belong to ``rigid_body``. The ground is MuJoCo's own contact of a plane and four feet, stiff and
sticky as its defaults are. Drag torque (Eq. 9) is held over a step. It is not made for Numba: it flies over ROS and in
the Python loop. The wrench acts at a site: it turns with the body in a step.
"""

import math
from functools import lru_cache
from threading import get_ident
from typing import NamedTuple

import mujoco

from quad_core.geometry import add, scale
from quad_core.types import Actuation, Conditions, Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import DragSign, Layout, Triple, Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.newton_euler import Body, true_body
from quad_dynamics.parameters import Ground, PlantParameters
from quad_dynamics.rigid_body import State, lumped, observe
from quad_dynamics.rotors import (
    allocate_within,
    decay,
    known_speeds,
    lagged,
    max_rotor_thrust,
    reached,
    rotor_lag,
    rotor_thrusts,
    rotor_wrench,
)

__all__ = ["Parameters", "State", "init", "lumped", "observe", "step"]

Parameters = PlantParameters
COMPILES = False
_MJCF = """
<mujoco>
  <compiler autolimits="true" balanceinertia="false"/>
  <option timestep="{step!r}" integrator="RK4" gravity="0 0 {gravity!r}">
    <flag autoreset="disable"/>
  </option>
  <worldbody>{floor}
    <body name="vehicle">
      <freejoint/>
      <inertial pos="0 0 0" mass="{body.mass!r}"
                diaginertia="{body.inertia_xx!r} {body.inertia_yy!r} {body.inertia_zz!r}"/>
      <site name="centre"/>{feet}
    </body>
  </worldbody>
  <actuator>
    <general site="centre" gear="0 0 1 0 0 0"/>
    <general site="centre" gear="0 0 0 1 0 0"/>
    <general site="centre" gear="0 0 0 0 1 0"/>
    <general site="centre" gear="0 0 0 0 0 1"/>
  </actuator>
</mujoco>
"""
_FLOOR = """
    <geom type="plane" size="0 0 1" pos="0 0 {floor.height!r}" friction="{floor.friction!r} 0 0"/>"""
_FOOT = """
      <geom type="sphere" size="{size!r}" pos="{foot.x!r} {foot.y!r} {centre!r}" mass="0"
            friction="{friction!r} 0 0"/>"""
_FOOT_SIZE = 0.01  # radius of a foot, m; its lowest point is where the foot is said to be
_VEHICLE = 1  # index of the vehicle among the bodies of the model; 0 is the world


class Floor(NamedTuple):
    """Flat ground at ``height`` m under ``feet`` m (body), with sliding friction."""

    height: float
    friction: float
    feet: tuple[Vec3, ...]


class FreeBody:
    """A free body under gravity and linear drag. It keeps nothing between calls of its thread that changes a result."""

    def __init__(self, body: Body, step: float, floor: Floor | None = None) -> None:
        """Compile the model of ``body`` with steps of ``step`` s; raises ValueError if MuJoCo refuses it."""
        ground, feet = "", ""
        if floor is not None:
            ground, shape = _FLOOR.format(floor=floor), {"size": _FOOT_SIZE, "friction": floor.friction}
            feet = "".join(_FOOT.format(foot=foot, centre=foot.z + _FOOT_SIZE, **shape) for foot in floor.feet)
        text = _MJCF.format(body=body, step=step, gravity=-body.gravity, floor=ground, feet=feet)
        self._model = mujoco.MjModel.from_xml_string(text)
        # a free joint has three translations along the world's axes, then three rotations about the body's
        self._model.dof_damping[:3] = body.drag_coefficient
        self._data = mujoco.MjData(self._model)
        self._drag_torque = body.drag_torque_coefficient

    def moved(self, motion: VehicleState, thrust: float, torque_b: Triple, force_w: Triple, steps: int) -> VehicleState:
        """Return the motion ``steps`` steps later under thrust N along body z, torque N m (body) and force N (world).

        Drag torque is that of the rates at the start of each step: MuJoCo has no quadratic one.
        """
        data = self._data
        x, y, z, w = motion.q_wb
        data.qpos[:] = (*motion.p_w, w, x, y, z)
        data.qvel[:] = (*motion.v_w, *motion.omega_b)
        data.xfrc_applied[_VEHICLE, :3] = force_w
        data.qacc_warmstart[:] = 0.0
        for _ in range(steps):
            p, q, r = data.qvel[3:6].tolist()
            k = self._drag_torque
            data.ctrl[:] = (
                thrust,
                torque_b[0] - k * abs(p) * p,
                torque_b[1] - k * abs(q) * q,
                torque_b[2] - k * abs(r) * r,
            )
            mujoco.mj_step(self._model, data)
        px, py, pz, w, x, y, z = data.qpos.tolist()
        vx, vy, vz, p, q, r = data.qvel.tolist()
        return VehicleState(Vec3(px, py, pz), Vec3(vx, vy, vz), Quat(x, y, z, w), Vec3(p, q, r))


def free_body(body: Body, step: float, floor: Floor | None = None) -> FreeBody:
    """Return the model of ``body``, compiled once in each thread: MuJoCo lets others run while it integrates."""
    return _of_thread(get_ident(), body, step, floor)


@lru_cache(maxsize=64)
def _of_thread(thread: int, body: Body, step: float, floor: Floor | None) -> FreeBody:  # noqa: ARG001
    return FreeBody(body, step, floor)


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return the state at step 0.

    Raises ValueError if mass, inertia, drag or lag, errors included, are not physical, or printed drag is asked for.
    """
    if parameters.drag_sign == DragSign.PRINTED:
        raise ValueError("mujoco.drag_sign: found 'printed', expected 'corrected': MuJoCo's damping only slows down")
    start = rigid_body.init(parameters, vehicle)
    free_body(true_body(parameters, vehicle, 0.0), 1e-3)
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
    body = true_body(parameters, vehicle, conditions.payload_mass)
    commanded = actuation.rotor_speed
    speeds = middle = commanded
    thrusts = actuation.rotor_thrust
    lag = rotor_lag(parameters, vehicle)
    if lag > 0.0:
        half_decay = decay(lag, 0.5 * dt)
        middle = lagged(state.rotor_speed, commanded, half_decay)
        speeds = lagged(state.rotor_speed, commanded, half_decay * half_decay)
        thrusts = rotor_thrusts(vehicle, middle)
    known = known_speeds(parameters, vehicle, state.known_speed, commanded, speeds, dt)
    if lag > 0.0 or parameters.lag_error != 0.0:
        actuation = reached(vehicle, actuation, known)
    rotors = rotor_wrench(
        vehicle,
        parameters.effectiveness,
        conditions.rotor_effectiveness,
        thrusts=thrusts,
        speeds=middle,
        commanded=commanded,
        lag=lag,
    )
    force_w = add(conditions.force_w, scale(body.drag_coefficient, conditions.wind_w))
    motion = free_body(body, dt / parameters.substeps, floor(parameters.ground, vehicle)).moved(
        state.motion, rotors.thrust, add(rotors.torque_b, conditions.torque_b), force_w, parameters.substeps
    )
    return State(motion, speeds, known), actuation
