"""The vehicle behind the interface: a rigid body with drag.

    m v' = thrust * z_b - m g - m drag v,    J omega' = tau - omega x J omega

A real interface talks to hardware or to another program here; it takes a wrench and tells a state.
"""

import numpy as np

from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle


class Craft:
    """Integrates the body with steps of ``dt`` s, from rest at the origin."""

    def __init__(self, vehicle: Vehicle, drag: float) -> None:
        """Take mass in kg and inertia in kg m^2 of ``vehicle``; ``drag`` in 1/s."""
        self._mass, self._gravity, self._drag = vehicle.mass, vehicle.gravity, drag
        self._inertia = np.array([vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz])
        self._p, self._v, self._omega = np.zeros(3), np.zeros(3), np.zeros(3)
        self._q = np.array([0.0, 0.0, 0.0, 1.0])

    @property
    def state(self) -> VehicleState:
        """The state: ENU world, FLU body, quaternion xyzw from body to world."""
        p, v, q, omega = (array.tolist() for array in (self._p, self._v, self._q, self._omega))
        return VehicleState(Vec3(*p), Vec3(*v), Quat(*q), Vec3(*omega))

    def advance(self, wrench: Wrench, dt: float) -> None:
        """Apply ``wrench`` (N, N m, body) for ``dt`` s."""
        x, y, z, w = self._q
        up = np.array([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])
        weight = np.array([0.0, 0.0, -self._gravity])
        self._v = self._v + dt * (wrench.thrust / self._mass * up + weight - self._drag * self._v)
        self._p = self._p + dt * self._v
        turning = np.cross(self._omega, self._inertia * self._omega)
        self._omega = self._omega + dt * (np.array(wrench.torque_b) - turning) / self._inertia
        a, b, c = 0.5 * dt * self._omega
        turn = [w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a, -x * a - y * b - z * c]
        turned = self._q + np.array(turn)
        self._q = turned / np.linalg.norm(turned)
