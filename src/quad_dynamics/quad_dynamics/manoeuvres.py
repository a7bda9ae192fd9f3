"""What a quadrotor in ENU and FLU must do in the short manoeuvres from hover of check_plant. No ROS."""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from quad_core.geometry import euler_from_quaternion, norm, subtract
from quad_core.types import Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle

HALF, SETTLE, CLIMB_TIME = 0.12, 0.1, 0.3
"""s that a torque acts one way before it acts the other way, of flight without torque, and of a climb."""
TURN_RATE = 0.4  # angular velocity in rad/s in the middle of such a doublet
CLIMB = 0.2  # thrust above weight, as a part of it, while climbing
TOLERANCE = 0.7
"""Largest deviation from the nominal model, as a part of the expected change: rotor lag, errors and wind pass."""


class Measure(NamedTuple):
    """A number found from the states before and after a manoeuvre, and its bounds."""

    what: str
    value: Callable[[VehicleState, VehicleState], float]
    low: float
    high: float


class Manoeuvre(NamedTuple):
    """What is asked of the plant for ``duration`` s, and what is measured of it."""

    name: str
    duration: float
    wrench: Wrench
    measures: tuple[Measure, ...]

    def problem(self, before: VehicleState, after: VehicleState) -> str:
        """Return what was found out of bounds, empty if nothing was."""
        for what, value, low, high in self.measures:
            found = value(before, after)
            if not low <= found <= high:
                return f"{what}: found {found:.3g}, expected {low:.3g} to {high:.3g}"
        return ""


def manoeuvres(vehicle: Vehicle) -> list[Manoeuvre]:
    """Return hover, climb, and for each body axis a doublet and its mirror image, which brings it back level."""
    weight = vehicle.mass * vehicle.gravity
    still = Measure("change of v_w in m/s", lambda old, new: norm(subtract(new.v_w, old.v_w)), 0.0, 0.3)
    plan = [Manoeuvre("hover", SETTLE, Wrench(weight, Vec3()), (still,))]
    for name, part in (("climb", CLIMB), ("brake", -CLIMB)):
        what, gained = "change of v_w.z in m/s (z up)", part * vehicle.gravity * CLIMB_TIME
        lifts = _near(what, lambda old, new: new.v_w.z - old.v_w.z, gained)
        plan.append(Manoeuvre(name, CLIMB_TIME, Wrench((1.0 + part) * weight, Vec3()), (lifts,)))
    for axis, inertia in enumerate((vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz)):
        plan += _doublets(axis, inertia, weight)
    return plan


def _doublets(axis: int, inertia: float, weight: float) -> list[Manoeuvre]:
    name = "xyz"[axis]

    def turn(label: str, sign: float) -> Manoeuvre:
        torque = Vec3(*(sign * inertia * TURN_RATE / HALF if part == axis else 0.0 for part in range(3)))
        what = f"change of omega_b.{name} in rad/s"
        turns = _near(what, lambda old, new: new.omega_b[axis] - old.omega_b[axis], sign * TURN_RATE)
        return Manoeuvre(label, HALF, Wrench(weight, torque), (turns,))

    angle = TURN_RATE * HALF
    what = f"{('roll', 'pitch', 'yaw')[axis]} in rad"
    tilted = [Measure(what, lambda old, _: euler_from_quaternion(old.q_wb)[axis], 0.3 * angle, 1.8 * angle)]
    if axis == 0:
        what = "change of v_w.y in m/s when rolled to the right (+, FLU)"
        tilted.append(Measure(what, lambda old, new: new.v_w.y - old.v_w.y, -math.inf, -1e-9))
    if axis == 1:
        what = "change of v_w.x in m/s when pitched nose down (+, FLU)"
        tilted.append(Measure(what, lambda old, new: new.v_w.x - old.v_w.x, 1e-9, math.inf))
    return [
        turn(f"torque +{name}", 1.0),
        turn(f"torque -{name}", -1.0),
        Manoeuvre(f"tilted by +{name}", SETTLE, Wrench(weight, Vec3()), tuple(tilted)),
        turn(f"torque -{name} again", -1.0),
        turn(f"torque +{name} again", 1.0),
    ]


def _near(what: str, value: Callable[[VehicleState, VehicleState], float], expected: float) -> Measure:
    width = TOLERANCE * abs(expected)
    return Measure(what, value, expected - width, expected + width)


def report(found: Mapping[str, str]) -> str:
    """Return one line for each of ``found``, {rule: what is wrong, empty if it is kept}, and a last with the result."""
    lines = [f"FAIL  {rule}: {problem}" if problem else f"ok    {rule}" for rule, problem in found.items()]
    broken = sum(map(bool, found.values()))
    return "\n".join([*lines, f"{len(found) - broken} of {len(found)} kept" + (f", {broken} broken" if broken else "")])
