"""One free rigid body as a MuJoCo model, driven through a site so that the wrench turns with the body inside a step."""

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import mujoco

from quad_core.types import Quat, Vec3, VehicleState
from quad_dynamics.newton_euler import Body, Triple

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
_FOOT_SIZE = 0.01
"""Radius of a foot, m; its lowest point is where the foot is said to be."""
_VEHICLE = 1
"""Index of the vehicle among the bodies of the model; 0 is the world."""


class Floor(NamedTuple):
    """Flat ground at ``height`` m under ``feet`` m (body), with sliding friction."""

    height: float
    friction: float
    feet: tuple[Vec3, ...]


class FreeBody:
    """A free body under gravity and linear drag. It keeps nothing between calls that changes a result."""

    def __init__(self, body: Body, step: float, floor: Floor | None = None) -> None:
        """Compile the model of ``body`` with steps of ``step`` s; raises ValueError if MuJoCo refuses it."""
        ground = _FLOOR.format(floor=floor) if floor is not None else ""
        feet = "".join(_feet(floor)) if floor is not None else ""
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


def _feet(floor: Floor) -> Iterable[str]:
    for foot in floor.feet:
        yield _FOOT.format(foot=foot, centre=foot.z + _FOOT_SIZE, size=_FOOT_SIZE, friction=floor.friction)


@lru_cache(maxsize=64)
def free_body(body: Body, step: float, floor: Floor | None = None) -> FreeBody:
    """Return the model of ``body``, compiled once."""
    return FreeBody(body, step, floor)
