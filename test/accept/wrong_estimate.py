"""Sensing of an estimator that is wrong as a whole: metres off, adrift, its compass turned; for ``take_offs``.

Position = p + offset + drift t, velocity = v, + drift where it shows, attitude = q turned about the vertical by yaw.
"""

from typing import NamedTuple

import numpy as np

from quad_core.types import SensorFault, Vec3, VehicleState, fresh, misread


class Parameters(NamedTuple):
    """Offset in m, drift in m/s, turns in rad; ``shows``: 1 if the velocity tells the drift, else 0."""

    offset: Vec3 = Vec3()
    drift: Vec3 = Vec3()
    yaw: float = 0.0
    shows: float = 1.0
    period: float = 0.002


class Memory(NamedTuple):
    """Whether the estimate differs from the truth, and whether it is frozen."""

    active: bool
    frozen: bool


def draw(parameters, seed, steps):
    """Return the random numbers: none."""
    return np.zeros((1, 1))


def init(parameters, plant_period):
    """Return the delay line and the memory before step 0."""
    return np.zeros((1, 1)), Memory(True, False)


def step(
    parameters: Parameters, table: object, line: object, memory: Memory, truth: VehicleState, fault: SensorFault, k: int
) -> tuple[VehicleState, Memory]:  # fmt: skip
    """Return the estimate at plant step ``k``, and the memory."""
    time = k * parameters.period
    o, d, shows = parameters.offset, parameters.drift, parameters.shows
    moved = Vec3(o.x + d.x * time, o.y + d.y * time, o.z + d.z * time)
    seen = misread(truth, SensorFault(False, moved, parameters.yaw))
    v = seen.v_w
    v = Vec3(v.x + shows * d.x, v.y + shows * d.y, v.z + shows * d.z)
    return fresh(seen.p_w, v, seen.q_wb, seen.omega_b), memory
