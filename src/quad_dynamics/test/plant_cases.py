"""What the plant tests share: an asymmetric vehicle, every error of Eq. 10, an independent model."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from quad_core.types import Actuation, Conditions, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics.parameters import (
    Effectiveness,
    InertiaError,
    Initial,
    InitialAngles,
    InitialPosition,
    InitialRates,
    InitialVelocity,
    PlantParameters,
)
from quad_dynamics.rotors import allocate_within, rotor_limit

ASYMMETRIC = Vehicle(
    mass=1.3,
    gravity=9.81,
    arm_length=0.21,
    inertia_xx=0.011,
    inertia_yy=0.017,
    inertia_zz=0.026,
    lift_coefficient=3.1e-5,
    torque_coefficient=2.2e-6,
    drag_coefficient=0.37,
    drag_torque_coefficient=2.9e-3,
    thrust_to_weight=3.5,
)
WRONG = PlantParameters(
    mass_error=0.31,
    inertia_error=InertiaError(0.002, -0.003, 0.005),
    drag_error=0.11,
    effectiveness=Effectiveness(0.9, 0.8, 1.1, 0.7),
)
NO_DRAG = ASYMMETRIC._replace(drag_coefficient=0.0, drag_torque_coefficient=0.0)
NONE = Vec3(0.0, 0.0, 0.0)


def allocate(vehicle: Vehicle, wrench: Wrench) -> Actuation:
    """Return what four ideal rotors with a full battery make of ``wrench``."""
    return allocate_within(vehicle, wrench, rotor_limit(vehicle))


def starting(
    p: Iterable[float] = NONE, v: Iterable[float] = NONE, angles: Iterable[float] = NONE, omega: Iterable[float] = NONE
) -> Initial:
    """Return a state at step 0 in m, m/s, rad and rad/s."""
    return Initial(InitialPosition(*p), InitialVelocity(*v), InitialAngles(*angles), InitialRates(*omega))


def under(force: Vec3 = NONE, torque: Vec3 = NONE) -> Conditions:
    """Return conditions with an outer force N (world) and torque N m (body), all else calm."""
    return Conditions(force_w=force, torque_b=torque)


def numbers(value: Any) -> Iterable[float]:
    """Yield every number of nested tuples, depth first; of a state only what moves, not its ages or its ground."""
    if isinstance(value, tuple):
        for part in value[:4] if isinstance(value, VehicleState) else value:
            yield from numbers(part)
    else:
        yield value


def flat(value: Any) -> np.ndarray:
    """Return every number of nested tuples as an array."""
    return np.array(list(numbers(value)), dtype=float)


def motion(state: Any) -> np.ndarray:
    """Return the body's part of a plant's state: all of Eq. 16, or the 13 numbers before the rotor speeds."""
    return flat(state)[:13]


def vector(rng: np.random.Generator, size: float) -> Vec3:
    """Return a vector with components in +-size."""
    return Vec3(*rng.uniform(-size, size, 3).tolist())


def gentle_wrench(rng: np.random.Generator, vehicle: Vehicle) -> Wrench:
    """Return a random wrench that the rotors can make."""
    hover = vehicle.mass * vehicle.gravity
    tilt = 0.1 * vehicle.arm_length * hover
    yaw = 0.1 * hover * vehicle.torque_coefficient / vehicle.lift_coefficient
    return Wrench(
        hover * rng.uniform(0.6, 1.6), Vec3(rng.uniform(-tilt, tilt), rng.uniform(-tilt, tilt), rng.uniform(-yaw, yaw))
    )


class Reference:
    """Right sides of Eqs. 1 and 16 in matrices, after the paper and SciPy, not after the code under test."""

    def __init__(self, vehicle: Vehicle, parameters: PlantParameters) -> None:
        """Take the true vehicle's mass, inertia and drag."""
        error = parameters.inertia_error
        self.m = vehicle.mass + parameters.mass_error
        self.inertia = np.diag(
            [vehicle.inertia_xx + error.xx, vehicle.inertia_yy + error.yy, vehicle.inertia_zz + error.zz]
        )
        self.weight = self.m * np.array([0.0, 0.0, -vehicle.gravity])
        self.k_f, self.k_t = vehicle.drag_coefficient + parameters.drag_error, vehicle.drag_torque_coefficient
        self.printed = parameters.drag_sign == 1
        self.effectiveness = np.array(parameters.effectiveness)

    def accelerations(
        self, rotation: np.ndarray, v: np.ndarray, rates: np.ndarray, wrench: Wrench, force: Vec3, torque: Vec3
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return P'' and Omega' of Eq. 1 (Eq. 10 with the errors) for a wrench that the rotors make as asked."""
        applied = self.effectiveness * np.array([wrench.thrust, *wrench.torque_b])
        drag = self.k_f * v if self.printed else -self.k_f * v
        drag_torque = self.k_t * rates**2 if self.printed else -self.k_t * np.sign(rates) * rates**2
        p2 = (rotation @ [0.0, 0.0, applied[0]] + self.weight + drag + np.array(force)) / self.m
        moment = -np.cross(rates, self.inertia @ rates) + applied[1:] + drag_torque + np.array(torque)
        return p2, np.linalg.solve(self.inertia, moment)

    def rigid_body(self, wrench: Wrench, force: Vec3, torque: Vec3) -> Any:
        """Return f(t, y) with y = (p, v, q, omega) of Eq. 1."""

        def rate(_t: float, y: np.ndarray) -> np.ndarray:
            q, omega = y[6:10], y[10:]
            a, alpha = self.accelerations(Rotation.from_quat(q).as_matrix(), y[3:6], omega, wrench, force, torque)
            p, r, s = omega
            four = np.array([[0, s, -r, p], [-s, 0, p, r], [r, -p, 0, s], [-p, -r, -s, 0]])
            return np.concatenate([y[3:6], a, 0.5 * four @ q, alpha])

        return rate

    def paper(self, wrench: Wrench, force: Vec3, torque: Vec3) -> Any:
        """Return f(t, X) of Eq. 16."""

        def rate(_t: float, x: np.ndarray) -> np.ndarray:
            rotation = Rotation.from_euler("ZYX", [x[4], x[2], x[0]]).as_matrix()
            a, alpha = self.accelerations(rotation, x[7::2], x[1:6:2], wrench, force, torque)
            out = np.empty(12)
            out[0::2] = x[1::2]
            out[1:6:2], out[7::2] = alpha, a
            return out

        return rate
