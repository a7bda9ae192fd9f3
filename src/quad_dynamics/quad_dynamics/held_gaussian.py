"""Disturbance ``held_gaussian``: the paper's section 4, six independent clipped Gaussians, each value held for a while.

Appendix A: disturbances enter as acceleration, hence force m d and torque I d with the nominal m and I. The paper's
"standard deviation 10, scaled" says no scale and a Gaussian has no bound; the defaults fix both.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.parameters import Real
from quad_core.types import CALM, Conditions, Vec3
from quad_core.vehicle import Vehicle

CHANNELS = 6
STREAM_FAMILY = 1
EDGE_TOLERANCE = 1e-9


class Parameters(NamedTuple):
    """Size, bound and hold time of the six channels."""

    acceleration_sd: Annotated[float, Real("m/s^2", "sd of d_x, d_y, d_z, unclipped", 0.0, 100.0, "sect. 4")] = 0.5
    acceleration_clip: Annotated[float, Real("m/s^2", "bound of d_x, d_y, d_z", 0.0, 1000.0, "sect. 4")] = 1.5
    angular_sd: Annotated[float, Real("rad/s^2", "that of d_phi, d_theta, d_psi", 0.0, 1e3, "sect. 4")] = 2.0 / 3.0
    angular_clip: Annotated[float, Real("rad/s^2", "bound of d_phi, d_theta, d_psi", 0.0, 1e4, "sect. 4")] = 2.0
    hold: Annotated[float, Real("s", "time for which a value is held", 0.001, 1000.0, "sect. 4")] = 2.0


def draw(parameters: Parameters, vehicle: Vehicle, seed: int, duration: float) -> NDArray[np.float64]:
    """Return the table of a flight of ``duration`` s: shape (n, 6), rows of force N (world) and torque N m (body).

    Each channel has its own stream of (seed, channel): a longer flight begins like a shorter one, and no channel
    depends on another.
    """
    count = math.floor(duration / parameters.hold + EDGE_TOLERANCE) + 1
    sd = np.repeat((parameters.acceleration_sd, parameters.angular_sd), 3)
    clip = np.repeat((parameters.acceleration_clip, parameters.angular_clip), 3)
    inertia = np.array((vehicle.mass,) * 3 + (vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz))
    normals = np.empty((count, CHANNELS))
    for channel in range(CHANNELS):
        stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM_FAMILY, channel)))
        normals[:, channel] = stream.standard_normal(count)
    return inertia * np.clip(sd * normals, -clip, clip)


def sample(parameters: Parameters, table: NDArray[np.float64], time: float) -> Conditions:
    """Return force N (world) and torque N m (body) at ``time`` s since the start; before and after, the nearest row."""
    # a time that rounding put just before an edge belongs to the new value
    index = math.floor(time / parameters.hold + EDGE_TOLERANCE)
    if index < 0:
        index = 0
    if index > len(table) - 1:
        index = len(table) - 1
    # no view of a row: Numba would count references to it at every step
    return Conditions(
        force_w=Vec3(float(table[index, 0]), float(table[index, 1]), float(table[index, 2])),
        torque_b=Vec3(float(table[index, 3]), float(table[index, 4]), float(table[index, 5])),
        wind_w=CALM.wind_w,
        payload_mass=CALM.payload_mass,
        rotor_effectiveness=CALM.rotor_effectiveness,
        thrust_limit=CALM.thrust_limit,
        sensor=CALM.sensor,
        link=CALM.link,
    )
