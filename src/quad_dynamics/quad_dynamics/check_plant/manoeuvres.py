"""Short manoeuvres from hover and what a quadrotor in ENU and FLU must do in them. No ROS."""

import math
from collections.abc import Callable
from typing import NamedTuple

from quad_core.geometry import euler_from_quaternion
from quad_core.types import Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle

HALF = 0.12
"""Seconds that a torque acts one way before it acts the other way."""
TURN_RATE = 0.4
"""Angular velocity in rad/s in the middle of such a doublet."""
CLIMB = 0.2
"""Thrust above weight, as a part of it, while climbing."""
CLIMB_TIME = 0.3
SETTLE = 0.1
TOLERANCE = 0.7
"""Largest deviation from the nominal model, as a part of the expected change: rotor lag, errors and wind pass."""


class Manoeuvre(NamedTuple):
    """What is asked of the plant for ``duration`` s, and the check of the states at its start and end."""

    name: str
    duration: float
    wrench: Wrench
    judge: Callable[[VehicleState, VehicleState], str]


def manoeuvres(vehicle: Vehicle) -> list[Manoeuvre]:
    """Return hover, climb, and for each body axis a doublet and its mirror image, which brings it back level."""
    weight = vehicle.mass * vehicle.gravity
    none = Vec3(0.0, 0.0, 0.0)
    plan = [
        Manoeuvre("hover", SETTLE, Wrench(weight, none), _stays),
        Manoeuvre("climb", CLIMB_TIME, Wrench((1.0 + CLIMB) * weight, none), _climbs(vehicle)),
        Manoeuvre("brake", CLIMB_TIME, Wrench((1.0 - CLIMB) * weight, none), _brakes(vehicle)),
    ]
    for axis, inertia in enumerate((vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz)):
        torque = inertia * TURN_RATE / HALF
        plan += _doublet("xyz"[axis], axis, torque, weight)
    return plan


def _doublet(name: str, axis: int, torque: float, weight: float) -> list[Manoeuvre]:
    def wrench(sign: float) -> Wrench:
        parts = [0.0, 0.0, 0.0]
        parts[axis] = sign * torque
        return Wrench(weight, Vec3(*parts))

    return [
        Manoeuvre(f"torque +{name}", HALF, wrench(1.0), _turns(axis, TURN_RATE)),
        Manoeuvre(f"torque -{name}", HALF, wrench(-1.0), _turns(axis, -TURN_RATE)),
        Manoeuvre(f"tilted by +{name}", SETTLE, Wrench(weight, Vec3(0.0, 0.0, 0.0)), _drifts(axis)),
        Manoeuvre(f"torque -{name} again", HALF, wrench(-1.0), _turns(axis, -TURN_RATE)),
        Manoeuvre(f"torque +{name} again", HALF, wrench(1.0), _turns(axis, TURN_RATE)),
    ]


def _near(what: str, found: float, expected: float) -> str:
    if abs(found - expected) <= TOLERANCE * abs(expected):
        return ""
    return f"{what}: found {found:.3g}, expected {expected:.3g} within {TOLERANCE:.0%}"


def _stays(before: VehicleState, after: VehicleState) -> str:
    change = math.sqrt(sum((b - a) * (b - a) for a, b in zip(before.v_w, after.v_w, strict=True)))
    return "" if change <= 0.3 else f"velocity changed by {change:.3g} m/s under thrust m g, expected at most 0.3"


def _climbs(vehicle: Vehicle) -> Callable[[VehicleState, VehicleState], str]:
    gain = CLIMB * vehicle.gravity * CLIMB_TIME
    return lambda before, after: _near("change of v_w.z in m/s (z up)", after.v_w.z - before.v_w.z, gain)


def _brakes(vehicle: Vehicle) -> Callable[[VehicleState, VehicleState], str]:
    gain = -CLIMB * vehicle.gravity * CLIMB_TIME
    return lambda before, after: _near("change of v_w.z in m/s (z up)", after.v_w.z - before.v_w.z, gain)


def _turns(axis: int, change: float) -> Callable[[VehicleState, VehicleState], str]:
    name = f"change of omega_b.{'xyz'[axis]} in rad/s"
    return lambda before, after: _near(name, after.omega_b[axis] - before.omega_b[axis], change)


def _drifts(axis: int) -> Callable[[VehicleState, VehicleState], str]:
    """Judge the attitude after a doublet and where it carries the vehicle: roll to -y, pitch to +x, yaw nowhere."""
    turned = TURN_RATE * HALF

    def judge(before: VehicleState, after: VehicleState) -> str:
        angle = euler_from_quaternion(before.q_wb)[axis]
        if not 0.3 * turned <= angle <= 1.8 * turned:
            return f"{('roll', 'pitch', 'yaw')[axis]} in rad: found {angle:.3g}, expected about {turned:.3g}"
        if axis == 0 and not after.v_w.y < before.v_w.y:
            return "roll to the right (+) must carry the vehicle to -y (FLU), it did not"
        if axis == 1 and not after.v_w.x > before.v_w.x:
            return "pitch nose down (+) must carry the vehicle to +x (FLU), it did not"
        return ""

    return judge
