"""How far open loop holds: the plant under the commands that were flown, begun anew from recorded states.

Each second of flight the plant ``rigid_body`` of a vehicle starts at the recorded state and runs for a second. Rotors
keep their speed from one second to the next. Beside it stands the prediction of no model: velocity, attitude and rates
held.
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from quad_analysis.arrays import Floats, Stamps, by_stamp, norms
from quad_analysis.metrics import thrust_and_torque
from quad_analysis.replay import tuples_of
from quad_analysis.tables import PARAMETERS, NodeRecord, flown_phases, recorded_parameters, truth_topic
from quad_analysis.text import aligned
from quad_core.cascade import COMMAND, POSITION, SIMULATOR, STAGE
from quad_core.cycle import is_flyable
from quad_core.parameter_files import overrides_for, read_parameter_file
from quad_core.parameters import ParameterError, Value
from quad_core.plugins import names
from quad_core.resolution import Resolved, resolve
from quad_core.types import CALM, Vec3, VehicleState, Wrench
from quad_core.vehicle import ARRANGEMENTS, Layout, Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.rotors import DIAGONAL, rotor_limit, yaw_arm
from quad_flight_log.errors import FlightLogError, TopicError
from quad_flight_log.notes import CURVE, ROTORS
from quad_flight_log.reader import Flight

HORIZONS = (0.1, 0.5, 1.0)  # s
BOUNDS = {"position": 0.1, "attitude": np.radians(5.0)}  # RMS errors, m and rad, up to which open loop holds
IDLE = 0.3  # of the weight: below it the vehicle stands, or the motors are off
LONGEST_GAP = 5  # times the usual step: a longer one ends a second
UNITS = {
    "position": ("m", 1.0),
    "velocity": ("m/s", 1.0),
    "attitude": ("deg", float(np.degrees(1.0))),
    "rates": ("rad/s", 1),
}


def vehicle_settings(flight: Flight, path: Path | None) -> dict[str, Value]:
    """Return {vehicle.*: value} of the vehicle file ``path``; empty for a bag that says with which vehicle it flew.

    Raises FlightLogError naming what lacks.
    """
    if path is None:
        if not flight.has(PARAMETERS):
            raise FlightLogError(f"{flight.path}: no vehicle: the bag has no {PARAMETERS}; give --vehicle FILE")
        return {}
    if not path.is_file():
        there = "those that ship are in src/quad_flight/quad_flight/config/vehicles"
        raise FlightLogError(f"--vehicle: found {str(path)!r}, expected a vehicle file ({there})")
    try:
        content = overrides_for([read_parameter_file(path)], SIMULATOR)
    except ParameterError as error:
        raise FlightLogError(str(error)) from error
    values = {name: value for name, value in content.items() if name.startswith("vehicle.")}
    if not values:
        raise FlightLogError(f"{path}: found no vehicle.*, expected a vehicle file as scripts/identify writes it")
    return values


def gains_of(path: Path | None) -> dict[str, dict[str, Value]]:
    """Return {role: parameters} of the controllers in the file ``path``, of all laws; raises FlightLogError."""
    try:
        return {role: overrides_for([read_parameter_file(path)], role) for role in STAGE} if path else {}
    except ParameterError as error:
        raise FlightLogError(str(error)) from error


def phases_of(flight: Flight, role: str, law: str | None, values: dict[str, Value]) -> list[tuple[int, Resolved]]:
    """Return (step, parameters from it on) of a controller, its defaults where the bag says nothing of it."""
    found = recorded_parameters(flight).get(role) if flight.has(PARAMETERS) else None
    record = found or NodeRecord({}, [], ())
    flying = law or record.values.get("law") or resolve(role, {}).plugins["law"].name
    others = {*names(STAGE[role].group)} - {flying}  # a file of gains has those of many laws
    values = {name: value for name, value in values.items() if name.partition(".")[0] not in others}
    changes = tuple(change._replace(values=change.values | values) for change in record.changes)
    return flown_phases(record._replace(values=record.values | values, changes=changes), role, law)


def flown_wrench(flight: Flight, vehicle: Vehicle) -> tuple[Stamps, Floats]:
    """Return stamps in ns and (thrust N, torque N m), shape (n, 4), that were commanded or that the motors made.

    The thrust of a motor is its largest times ``curve`` of the bag: the share of the square of its command, which alone
    counts where none is said. Raises TopicError.
    """
    if flight.has(COMMAND):
        table = by_stamp(flight.array(COMMAND))
        return table["stamp_ns"], np.column_stack(thrust_and_torque(table))
    if not flight.has("motors"):
        raise TopicError(f"{flight.path}: no motors: the bag has neither {COMMAND} nor motors")
    table = by_stamp(flight.array("motors"))
    field = "normalized" if len(table["normalized"][0]) else "velocity"
    if {len(row) for row in table[field]} != {4}:
        raise TopicError(f"{flight.path}: motors: {field}: expected four numbers in every message")
    commands = np.stack(list(table[field]))
    each = vehicle.lift_coefficient * commands * commands
    if field == "normalized":
        curve = float(flight.metadata.get(CURVE, 1.0))
        each = rotor_limit(vehicle) * (curve * commands + 1.0 - curve) * commands
    arm = vehicle.arm_length * (DIAGONAL if vehicle.layout == Layout.X else 1.0)
    turns = np.array(ARRANGEMENTS[flight.metadata.get(ROTORS, "x")].levers, float)
    return table["stamp_ns"], np.column_stack([each.sum(axis=1), each @ turns.T * (arm, arm, yaw_arm(vehicle))])


def held_at(stamps: Stamps, wrench: Floats, times: Stamps) -> Floats:
    """Return the rows of ``wrench`` in force at ``times``; zero before the first."""
    at = np.searchsorted(stamps, times, side="right") - 1
    held: Floats = np.where(at[:, None] >= 0, wrench[at], 0.0)
    return held


class Refly(NamedTuple):
    """RMS errors over ``seconds`` of flight, shape (k, 4): position m, velocity m/s, attitude rad, rates rad/s.

    ``times``: s ahead, shape (k,). ``held``: those without a model. ``left_out``: seconds that the plant did not end.
    """

    times: Floats
    errors: Floats
    held: Floats
    seconds: int
    left_out: int

    def trusted(self, quantity: str) -> float | None:
        """Return the s up to which the RMS error of ``quantity`` is within its bound; None: all along."""
        above = np.flatnonzero(self.errors[:, list(UNITS).index(quantity)] > BOUNDS[quantity])
        return float(self.times[above[0] - 1] if above[0] else 0.0) if len(above) else None

    def text(self) -> str:
        """Return the table, and how far the model holds."""
        rows = [["error, RMS", "unit", *(f"{end:g} s" for end in HORIZONS), *(f"held {end:g} s" for end in HORIZONS)]]
        at = [int(np.argmin(np.abs(self.times - end))) for end in HORIZONS]
        for column, (quantity, (unit, factor)) in enumerate(UNITS.items()):
            cells = [f"{factor * part[k, column]:.3g}" for part in (self.errors, self.held) for k in at]
            rows.append([quantity, unit, *cells])
        left = f"; {self.left_out} left out: the plant diverged" if self.left_out else ""
        return "\n".join([aligned(rows, range(2, 8)), f"over {self.seconds} seconds of flight{left}", self.horizon()])

    def horizon(self) -> str:
        """Return the sentence that says how far open loop holds."""
        parts = []
        for quantity, bound in BOUNDS.items():
            end, (unit, factor) = self.trusted(quantity), UNITS[quantity]
            reach = f"{end:.2f} s" if end is not None else f"{self.times[-1]:.1f} s and more"
            parts.append(f"{reach} by {quantity} ({factor * bound:.3g} {unit} RMS)")
        return f"open loop holds for {', '.join(parts)}"


def refly(flight: Flight, values: dict[str, Value]) -> Refly:
    """Return how well the plant of ``vehicle_settings`` goes on from recorded states; raises FlightLogError."""
    vehicle, source = phases_of(flight, POSITION, None, values)[0][1].vehicle, truth_topic(flight)
    if not flight.has(source):
        raise TopicError(f"{flight.path}: no state: position, velocity, attitude and rates are needed")
    table = by_stamp(flight.array(source))
    states, stamps = tuples_of(VehicleState, table, f"{flight.path}: {source}"), table["stamp_ns"]
    wrench = held_at(*flown_wrench(flight, vehicle), stamps)
    steps = np.diff(stamps) * 1e-9
    usual = float(np.median(steps)) if len(steps) else 1.0
    count = round(HORIZONS[-1] / usual)
    flying = (wrench[:-1, 0] > IDLE * vehicle.mass * vehicle.gravity) & (steps < LONGEST_GAP * usual)
    flying &= ~np.array([state.on_ground for state in states[:-1]], dtype=bool)
    wrenches = [Wrench(up, Vec3(*turn)) for up, *turn in wrench.tolist()]
    parameters, at, left_out, errors, held = rigid_body.Parameters(), 0, 0, list[Floats](), list[Floats]()
    plant = rigid_body.init(parameters, vehicle)
    while at + count < len(states):
        if not flying[at : at + count].all():
            at += 1 + int(np.flatnonzero(~flying[at : at + count])[-1])
            continue
        plant, motions = plant._replace(motion=states[at]), list[Any]()
        for step in range(at, at + count):
            plant, _ = rigid_body.step(parameters, vehicle, plant, wrenches[step], CALM, float(steps[step]))
            if not is_flyable(plant.motion):
                break
            motions.append(rigid_body.flat(plant.motion))
        if len(motions) == count:
            true = np.array([rigid_body.flat(state) for state in states[at : at + count + 1]])
            errors.append(_apart(np.array(motions), true[1:]))
            still = np.repeat(true[:1], count, axis=0)
            still[:, :3] += np.cumsum(steps[at : at + count])[:, None] * true[0, 3:6]
            held.append(_apart(still, true[1:]))
        else:
            plant, left_out = rigid_body.init(parameters, vehicle), left_out + 1
        at += count
    if not errors:
        expected = f"expected a second without a gap in which motors carry {IDLE:g} of the weight"
        raise FlightLogError(f"{flight.path}: found none, {expected}")
    rms, rms_held = (np.sqrt(np.mean(np.square(part), axis=0)) for part in (errors, held))
    times = np.linspace(usual, count * usual, count)
    return Refly(times, rms, rms_held, len(errors), left_out)


def _apart(one: Floats, other: Floats) -> Floats:
    """Return how far motions, shape (n, 13), are apart: position, velocity, angle, rates, shape (n, 4)."""
    angle = 2.0 * np.arccos(np.clip(np.abs((one[:, 6:10] * other[:, 6:10]).sum(axis=1)), 0.0, 1.0))
    parts = [norms(one[:, part] - other[:, part]) for part in (slice(0, 3), slice(3, 6), slice(10, 13))]
    return np.column_stack([*parts[:2], angle, parts[2]])
