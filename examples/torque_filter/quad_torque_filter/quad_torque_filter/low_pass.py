"""A low-pass of first order for each axis of the torque, a ``quad.torque_filter`` plug-in.

T tau_f' + tau_f = tau,    exact for a torque that is held over dt
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_core.types import Vec3, Wrench
from quad_core.vehicle import Vehicle
from quad_torque_filter.stage import TorqueFilterInputs, TorqueFilterInternals


class Parameters(NamedTuple):
    """How slow the filter is."""

    time_constant: Annotated[float, Real("s", "T: after T, 63 % of a step have passed", 1e-4, 10.0)] = 0.004


class Memory(NamedTuple):
    """The filtered torque in N m (body)."""

    torque_b: Vec3 = Vec3()


Internals = TorqueFilterInternals


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:
    """Return the memory before the first step: no torque."""
    return Memory(Vec3(0.0, 0.0, 0.0))


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: TorqueFilterInputs, dt: float
) -> tuple[Wrench, Memory, TorqueFilterInternals]:
    """Return the wrench for the vehicle, the memory and what the bag shows."""
    share = 1.0 - math.exp(-dt / parameters.time_constant)
    raw, last = inputs.wrench.torque_b, memory.torque_b
    smooth = Vec3(
        last.x + share * (raw.x - last.x), last.y + share * (raw.y - last.y), last.z + share * (raw.z - last.z)
    )
    removed = Vec3(raw.x - smooth.x, raw.y - smooth.y, raw.z - smooth.z)
    return Wrench(inputs.wrench.thrust, smooth), Memory(smooth), TorqueFilterInternals(removed)
