"""Short manoeuvres from hover and what a quadrotor in ENU and FLU must do in them. No ROS."""

from collections.abc import Callable
from typing import NamedTuple

from quad_core.geometry import euler_from_quaternion, norm, subtract
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

Check = Callable[[VehicleState, VehicleState], str]


class Manoeuvre(NamedTuple):
    """What is asked of the plant for ``duration`` s, and the check of the states at its start and end.

    ``asked``: the wrench and the parameters that it was made from, in words.
    """

    name: str
    duration: float
    wrench: Wrench
    check: Check
    asked: str

    def problem(self, before: VehicleState, after: VehicleState) -> str:
        """Return what was wrong and what had been asked for, empty if nothing was wrong."""
        found = self.check(before, after)
        return found and f"{found}; the check asked for {self.asked}"


def manoeuvres(vehicle: Vehicle) -> list[Manoeuvre]:
    """Return hover, climb, and for each body axis a doublet and its mirror image, which brings it back level."""
    weight = vehicle.mass * vehicle.gravity
    known = f"m g with vehicle.mass {vehicle.mass:g} kg and vehicle.gravity {vehicle.gravity:g} m/s^2"

    def lift(name: str, duration: float, factor: float, check: Check) -> Manoeuvre:
        asked = f"{factor * weight:.4g} N, {factor:g} {known}"
        return Manoeuvre(name, duration, Wrench(factor * weight, Vec3()), check, asked)

    plan = [
        lift("hover", SETTLE, 1.0, _stays),
        lift("climb", CLIMB_TIME, 1.0 + CLIMB, _lifts(vehicle, CLIMB)),
        lift("brake", CLIMB_TIME, 1.0 - CLIMB, _lifts(vehicle, -CLIMB)),
    ]
    for axis, inertia in enumerate((vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz)):
        plan += _doublet(axis, inertia, weight)
    return plan


def _doublet(axis: int, inertia: float, weight: float) -> list[Manoeuvre]:
    name, torque = "xyz"[axis], inertia * TURN_RATE / HALF
    asked = f"{torque:.4g} N m, for {TURN_RATE:g} rad/s with vehicle.inertia_{name}{name} {inertia:g} kg m^2"

    def turn(label: str, sign: float) -> Manoeuvre:
        wrench = Wrench(weight, Vec3(*(sign * torque if part == axis else 0.0 for part in range(3))))
        return Manoeuvre(label, HALF, wrench, _turns(axis, sign * TURN_RATE, sign * torque), asked)

    return [
        turn(f"torque +{name}", 1.0),
        turn(f"torque -{name}", -1.0),
        Manoeuvre(f"tilted by +{name}", SETTLE, Wrench(weight, Vec3()), _drifts(axis), "no torque at this tilt"),
        turn(f"torque -{name} again", -1.0),
        turn(f"torque +{name} again", 1.0),
    ]


def _near(what: str, found: float, expected: float, explained: str) -> str:
    if abs(found - expected) <= TOLERANCE * abs(expected):
        return ""
    return f"{what}: found {found:.3g}, expected {expected:.3g} within {TOLERANCE:.0%}{explained}"


def _stays(before: VehicleState, after: VehicleState) -> str:
    change = norm(subtract(after.v_w, before.v_w))
    return "" if change <= 0.3 else f"velocity changed by {change:.3g} m/s under thrust m g, expected at most 0.3"


def _lifts(vehicle: Vehicle, part: float) -> Check:
    """Check a thrust that is ``part`` of the weight above it."""

    def check(before: VehicleState, after: VehicleState) -> str:
        change = after.v_w.z - before.v_w.z
        lift = vehicle.gravity + change / CLIMB_TIME
        mass = f", as with {(1.0 + part) * vehicle.mass * vehicle.gravity / lift:.3g} kg" if lift > 0.0 else ""
        return _near("change of v_w.z in m/s (z up)", change, part * vehicle.gravity * CLIMB_TIME, mass)

    return check


def _turns(axis: int, change: float, torque: float) -> Check:
    def check(before: VehicleState, after: VehicleState) -> str:
        found = after.omega_b[axis] - before.omega_b[axis]
        inertia = f", as with {torque * HALF / found:.3g} kg m^2" if torque * found > 0.0 else ""
        return _near(f"change of omega_b.{'xyz'[axis]} in rad/s", found, change, inertia)

    return check


def _drifts(axis: int) -> Check:
    """Check the attitude after a doublet and where it carries the vehicle: roll to -y, pitch to +x, yaw nowhere."""
    turned = TURN_RATE * HALF

    def check(before: VehicleState, after: VehicleState) -> str:
        angle = euler_from_quaternion(before.q_wb)[axis]
        if not 0.3 * turned <= angle <= 1.8 * turned:
            return f"{('roll', 'pitch', 'yaw')[axis]} in rad: found {angle:.3g}, expected about {turned:.3g}"
        if axis == 0 and not after.v_w.y < before.v_w.y:
            return "roll to the right (+) must carry the vehicle to -y (FLU), it did not"
        if axis == 1 and not after.v_w.x > before.v_w.x:
            return "pitch nose down (+) must carry the vehicle to +x (FLU), it did not"
        return ""

    return check
