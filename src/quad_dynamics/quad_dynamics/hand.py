"""Sensing ``hand``: a hand lifts the vehicle and tilts it on the bench: right side down, nose down, a turn to the left.

What stands on the ground is shown as if it was lifted, tilted about one axis after the other and put down again:

    r(t) = (1 - cos pi t) / 2 from 0 to 1 within T s,   angle = A (r up - r down),   height = H (r up - r down)
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.geometry import body_rates, clamp, quaternion_from_euler
from quad_core.parameters import Real
from quad_core.types import SensorFault, Vec3, VehicleState, fresh

LIFTED, LOWERED, RAMP = 4.0, 18.5, 1.5
"""Flight times in s at which it is lifted and put down, and time in s of one ramp."""
ROLL, PITCH, YAW = 8.0, 11.5, 15.0  # flight times in s at which each tilt begins

TREMOR, TREMBLING = 1e-3, 50.0  # size in m and frequency in rad/s of a hand's tremor


class Parameters(NamedTuple):
    """How far the hand moves the vehicle."""

    height: Annotated[float, Real("m", "height to which it is lifted", 0.2, 1.0)] = 0.5
    angle: Annotated[float, Real("rad", "angle of each tilt", 0.1, 0.6)] = 0.35


class Memory(NamedTuple):
    """What simulated sensors remember; here nothing. ``period`` in ns."""

    active: bool
    frozen: bool
    period: int


def draw(parameters: Parameters, seed: int, steps: int) -> NDArray[np.float64]:  # noqa: ARG001
    """Return an empty table: nothing is random."""
    return np.zeros((1, 1))


def init(parameters: Parameters, plant_period: int) -> tuple[NDArray[np.float64], Memory]:  # noqa: ARG001
    """Return an empty delay line and the memory before step 0."""
    return np.zeros((1, 13)), Memory(True, False, plant_period)


def step(
    parameters: Parameters,
    table: NDArray[np.float64],  # noqa: ARG001
    line: NDArray[np.float64],  # noqa: ARG001
    memory: Memory,
    truth: VehicleState,
    fault: SensorFault,  # noqa: ARG001
    k: int,
) -> tuple[VehicleState, Memory]:
    """Return the state seen at plant step ``k``, and the memory."""
    time = k * memory.period / 1e9
    lift, climb = moved(time, LIFTED, LOWERED)
    if lift == 0.0:
        return truth, memory
    roll, rolling = moved(time, ROLL, ROLL + RAMP)
    pitch, pitching = moved(time, PITCH, PITCH + RAMP)
    yaw, yawing = moved(time, YAW, YAW + RAMP)
    size, p = parameters.angle, truth.p_w
    angles = Vec3(size * roll, size * pitch, size * yaw)
    rates = body_rates(angles, Vec3(size * rolling, size * pitching, size * yawing))
    # without a tremor it would pass for frozen
    height = parameters.height + TREMOR * math.sin(TREMBLING * time)
    place = Vec3(p.x, p.y, p.z + height * lift)
    velocity = Vec3(0.0, 0.0, height * climb + lift * TREMOR * TREMBLING * math.cos(TREMBLING * time))
    shown = fresh(place, velocity, quaternion_from_euler(angles), rates)
    return shown, memory


def moved(time: float, away: float, back: float) -> tuple[float, float]:
    """Return how far, 0 to 1, and how fast in 1/s what moves from ``away`` on and back from ``back`` on, in s."""
    up, rising = ramp(time - away)
    down, falling = ramp(time - back)
    return up - down, rising - falling


def ramp(time: float) -> tuple[float, float]:
    """Return the place, 0 to 1, and the speed in 1/s, ``time`` s after a ramp began."""
    phase = math.pi * clamp(time / RAMP, 0.0, 1.0)
    return 0.5 * (1.0 - math.cos(phase)), 0.5 * math.pi / RAMP * math.sin(phase)
