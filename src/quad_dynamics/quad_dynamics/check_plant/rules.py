"""What a quadrotor in ENU and FLU must do in short manoeuvres from hover, and what its messages must keep. No ROS."""

import math
from collections.abc import Callable
from typing import NamedTuple

from quad_core.cycle import is_flyable
from quad_core.flight_parameters import LOCKSTEP, FlightParameters
from quad_core.geometry import euler_from_quaternion, norm, subtract
from quad_core.types import Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle

HALF, SETTLE, CLIMB_TIME = 0.12, 0.1, 0.3
"""s that a torque acts one way before it acts the other way, of flight without torque, and of a climb."""
TURN_RATE = 0.4
"""Angular velocity in rad/s in the middle of such a doublet."""
CLIMB = 0.2
"""Thrust above weight, as a part of it, while climbing."""
TOLERANCE = 0.7
"""Largest deviation from the nominal model, as a part of the expected change: rotor lag, errors and wind pass."""
ACTUATION = "actuation of every step"


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


class Report:
    """What was checked, {rule: what was wrong with it, empty if it is kept}; the first problem of a rule stays."""

    def __init__(self) -> None:
        """Start empty."""
        self._found: dict[str, str] = {}

    def add(self, rule: str, problem: str = "") -> None:
        """Note that ``rule`` was checked and what was wrong."""
        self._found[rule] = self._found.get(rule) or problem

    @property
    def broken(self) -> dict[str, str]:
        """Return {rule: problem} of the broken rules."""
        return {rule: problem for rule, problem in self._found.items() if problem}

    def text(self) -> str:
        """Return one line per rule and a last line with the result."""
        lines = [f"FAIL  {rule}: {problem}" if problem else f"ok    {rule}" for rule, problem in self._found.items()]
        broken = f", {len(self.broken)} broken" if self.broken else ""
        return "\n".join([*lines, f"{len(self._found) - len(self.broken)} of {len(self._found)} kept{broken}"])


class Rules:
    """Checks states and actuations by the contract and notes the findings in a report."""

    def __init__(self, report: Report, flight: FlightParameters) -> None:
        """Check by the parameters of the flight."""
        self._report, self._flight = report, flight
        self.lockstep = flight.mode == LOCKSTEP
        self.last: tuple[int, VehicleState] | None = None
        self._actuated = -1

    def state(self, state: VehicleState, step: int, stamp_ns: int) -> bool:
        """Check a state; returns whether it is the last one again."""
        add = self._report.add
        last_step, last = self.last or (step - 1, None)
        if last is None:
            add("the first state is step 0", f"found {step}" if step else "")
        expected = step * self._flight.plant_period
        wrong = "" if stamp_ns == expected else f"step {step} has stamp {stamp_ns} ns, expected {expected}"
        add("stamp of state = step x flight.plant_period", wrong)
        wrong = "" if is_flyable(state) else f"step {step}: {state}"
        add("state is finite, within bounds, its quaternion of norm 1", wrong)
        if step == last_step:
            add("the state of a step comes once", f"step {step} came again")
            return True
        kept = step == last_step + 1 if self.lockstep else step > last_step
        order = "steps come in order" + (", none left out" if self.lockstep else "")
        add(order, "" if kept else f"{step} after {last_step}")
        self.last = (step, state)
        return False

    def actuation(self, step: int, numbers: tuple[float, ...]) -> None:
        """Check step, thrust and torque of one actuation."""
        kept = step in (self._actuated, self._actuated + 1) or not self.lockstep
        self._report.add(ACTUATION, "" if kept else f"step {step} after {self._actuated}")
        self._report.add("actuation is finite", "" if all(map(math.isfinite, numbers)) else f"step {step}")
        self._actuated = step

    def flight(self) -> None:
        """Check what should have been seen by the end of the manoeuvres."""
        newest = self.last[0] if self.last else 0
        behind = "" if newest - self._actuated <= 100 else f"none after step {self._actuated}, state is at {newest}"
        self._report.add(ACTUATION, behind)
