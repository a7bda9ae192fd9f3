"""What the commander's node observes, as numbers for ``modes.Health``: a node does no arithmetic of its own."""

import math

from quad_core.geometry import norm, subtract
from quad_core.types import Actuation, TrajectoryPoint, VehicleState
from quad_core.vehicle import Vehicle
from quad_guard.guard import age

__all__ = ["age", "position_error", "thrust_over_weight", "tilt"]


def tilt(state: VehicleState) -> float:
    """Return the angle in rad, 0 to pi, between body z and the vertical."""
    cosine = 1.0 - 2.0 * (state.q_wb.x * state.q_wb.x + state.q_wb.y * state.q_wb.y)
    if cosine >= 1.0:
        return 0.0
    return math.acos(cosine) if cosine > -1.0 else math.pi


def position_error(state: VehicleState, reference: TrajectoryPoint) -> float:
    """Return the distance in m of the vehicle from the reference that the commander sent."""
    return norm(subtract(state.p_w, reference.p_w))


def thrust_over_weight(vehicle: Vehicle, actuation: Actuation) -> float:
    """Return the achieved thrust in units of the nominal weight."""
    return actuation.thrust / (vehicle.mass * vehicle.gravity)
