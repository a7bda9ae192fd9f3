"""What replaces an input that went silent in real time."""

from typing import Any

from quad_core.geometry import ZERO, euler_from_quaternion, quaternion_from_euler
from quad_core.types import AttitudeThrust, TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle, max_thrust


def safe_input(topic: str, last: Any, vehicle: Vehicle, state: VehicleState) -> Any:
    """Return what a stage acts on when ``last``, its newest input of ``topic``, is too old; None: it cannot answer."""
    if topic == "reference":
        return hold_position(last)
    if topic == "attitude_setpoint":
        return level_hover(vehicle, state)
    return None


def level_hover(vehicle: Vehicle, state: VehicleState) -> AttitudeThrust:
    """Return level attitude at the present heading with the nominal hover thrust."""
    angles = Vec3(0.0, 0.0, euler_from_quaternion(state.q_wb).z)
    thrust = vehicle.mass * vehicle.gravity
    return AttitudeThrust(angles, ZERO, ZERO, quaternion_from_euler(angles), thrust, thrust / max_thrust(vehicle))


def hold_position(last: TrajectoryPoint) -> TrajectoryPoint:
    """Return the last reference at rest: its position and heading with all derivatives zero."""
    return TrajectoryPoint(last.trajectory_time, last.p_w, yaw=last.yaw)
