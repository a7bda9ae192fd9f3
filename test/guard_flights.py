"""Flights of the guard over ``rigid_body``, without ROS: a hover of the paper's laws with three faults, and descents.

One source for CPython and Numba.
"""

import math
from pathlib import Path
from typing import NamedTuple

from quad_attitude_ctrl import abfnitsm
from quad_core.geometry import norm, quaternion_from_euler
from quad_core.node_parameters import GuardParameters
from quad_core.parameter_files import overrides_for, read_parameter_file
from quad_core.parameters import build
from quad_core.types import (
    CALM,
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    Conditions,
    PositionInputs,
    Quat,
    Rotors,
    TrajectoryPoint,
    Vec3,
    VehicleState,
    Wrench,
    fresh,
)
from quad_core.vehicle import Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.rotors import rotor_speed
from quad_guard import guard
from quad_guard.checks import StateSample, WrenchCommand
from quad_guard.guard import FRESH_MEMORY, Inputs
from quad_position_ctrl import aibs

PERIOD = 2_000_000
POSITION_STEPS = 5
FOOT = 0.1
VEHICLES = Path(__file__).parents[1] / "src" / "quad_flight" / "quad_flight" / "config" / "vehicles"

WRENCH_LOST, WRENCH_NAN, WRENCH_ABSURD, WRENCH_OLD = range(4)
STATE_LOST, STATE_JUMP, STATE_FROZEN, STATE_NAN = range(4, 8)
DESCENT_ASKED, RELEASE_ASKED = 8, 9
KINDS = 10
CONDITIONS = len(guard.REASONS)

POSITION = build(aibs.Parameters, aibs.PRESETS["tuned"])
ATTITUDE = build(abfnitsm.Parameters, abfnitsm.PRESETS["tuned"])

guard_step = guard.step
position_init, position_step = aibs.init, aibs.step
attitude_init, attitude_step = abfnitsm.init, abfnitsm.step
plant_step, observe = rigid_body.step, rigid_body.observe


class Fault(NamedTuple):
    """What goes wrong from step ``begin`` until before ``end``."""

    kind: int = WRENCH_LOST
    begin: int = 0
    end: int = 0


NO_FAULT = Fault()


class Setup(NamedTuple):
    """What does not change over a flight. ``silent``: no controller ever answers."""

    vehicle: Vehicle
    guard: GuardParameters = GuardParameters()
    plant: PlantParameters = PlantParameters()
    conditions: Conditions = CALM
    silent: bool = False
    position: aibs.Parameters = POSITION
    attitude: abfnitsm.Parameters = ATTITUDE


class Outcome(NamedTuple):
    """How a flight ended: mode and reason of the guard, finite, contact, speed m/s and tilt rad then, largest tilt.

    ``stopped``: the guard has landed and stopped the motors; ``climb``: largest height above the start in m;
    ``visited``: bit mode * CONDITIONS + condition for each pair met.
    """

    steps: int
    mode: int
    reason: int
    finite: bool
    touched: bool
    speed: float
    tilt: float
    largest_tilt: float
    height: float
    climb: float
    visited: int
    stopped: bool


def vehicle_named(name):
    """Return a vehicle of the configuration folder."""
    values = overrides_for([read_parameter_file(VEHICLES / f"{name}.yaml")], "simulator")
    return build(Vehicle, {key.removeprefix("vehicle."): value for key, value in values.items()})


def draw_start(rng, vehicle, heights, tilt=60.0, speed=5.0, rate=2.0):
    """Return a random state within the envelope; rotors turn as in hover."""
    lean, towards = math.radians(rng.uniform(0.0, tilt)), rng.uniform(-math.pi, math.pi)
    half = 0.5 * lean
    yaw = quaternion_from_euler(Vec3(0.0, 0.0, rng.uniform(-math.pi, math.pi)))
    x, y, w = math.sin(half) * math.cos(towards), math.sin(half) * math.sin(towards), math.cos(half)
    q = Quat(x * yaw.w + y * yaw.z, y * yaw.w - x * yaw.z, w * yaw.z, w * yaw.w)
    z, around, size = rng.uniform(-1.0, 1.0), rng.uniform(-math.pi, math.pi), rng.uniform(0.0, speed)
    flat = math.sqrt(1.0 - z * z)
    v = Vec3(size * flat * math.cos(around), size * flat * math.sin(around), size * z)
    omega = Vec3(*(rng.uniform(-rate, rate) for _ in range(3)))
    turning = rotor_speed(vehicle, 0.25 * vehicle.mass * vehicle.gravity)
    motion = VehicleState(Vec3(0.0, 0.0, rng.uniform(*heights)), v, q, omega)
    return rigid_body.State(motion, Rotors(turning, turning, turning, turning))


def acts(fault: Fault, kind: int, k: int) -> bool:
    """Return whether ``fault`` is of this kind and acts at step ``k``."""
    return fault.kind == kind and fault.begin <= k < fault.end


def any_acts(a: Fault, b: Fault, c: Fault, kind: int, k: int) -> bool:
    """Return whether one of three faults is of this kind and acts at step ``k``."""
    return acts(a, kind, k) or acts(b, kind, k) or acts(c, kind, k)


def is_true(sample: StateSample, state: VehicleState) -> bool:
    """Return whether ``state`` arrived as it is."""
    return sample.arrived and sample.state == state


def spoiled(command: WrenchCommand, a: Fault, b: Fault, c: Fault, k: int) -> WrenchCommand:
    """Return what arrives of ``command`` under three faults."""
    wrench, step, arrived = command.wrench, command.step, command.arrived
    if any_acts(a, b, c, WRENCH_LOST, k):
        arrived = False
    if any_acts(a, b, c, WRENCH_NAN, k):
        wrench = Wrench(math.nan, wrench.torque_b)
    if any_acts(a, b, c, WRENCH_ABSURD, k):
        wrench = Wrench(1e6, wrench.torque_b)
    if any_acts(a, b, c, WRENCH_OLD, k):
        step = step - 60
    return WrenchCommand(wrench, step, arrived)


def asked(a: Fault, b: Fault, c: Fault, k: int) -> int:
    """Return what is asked of the guard at step ``k``: a descent, to give back, or nothing."""
    if any_acts(a, b, c, DESCENT_ASKED, k):
        return 2
    return 1 if any_acts(a, b, c, RELEASE_ASKED, k) else 0


def seen_state(state: VehicleState, frozen: VehicleState, a: Fault, b: Fault, c: Fault, k: int) -> StateSample:
    """Return what the estimator says of ``state`` under three faults."""
    p, q = state.p_w, state.q_wb
    if any_acts(a, b, c, STATE_JUMP, k):
        p = Vec3(p.x + 4.0, p.y, p.z)
    if any_acts(a, b, c, STATE_NAN, k):
        q = Quat(math.nan, q.y, q.z, q.w)
    reading = fresh(p, state.v_w, q, state.omega_b)
    if any_acts(a, b, c, STATE_FROZEN, k):
        reading = frozen
    return StateSample(reading, k, not any_acts(a, b, c, STATE_LOST, k))


def faulty_flight(
    setup: Setup, start: rigid_body.State, a: Fault, b: Fault, c: Fault, steps: int, longest: int
) -> Outcome:
    """Return how a hover of ``steps`` steps ends under three faults; a descent is followed to the ground.

    Where the state is faulty no controller's answer arrives; while the guard flies the answers are not flown.
    """
    vehicle, plant = setup.vehicle, start
    dt = PERIOD / 1e9
    zero = Vec3(0.0, 0.0, 0.0)
    none = Rotors(0.0, 0.0, 0.0, 0.0)
    actuation = Actuation(none, none, 0.0, zero, False, False, False, False, False)
    setpoint = AttitudeThrust(zero, zero, zero, Quat(0.0, 0.0, 0.0, 1.0), 0.0, 0.0)
    memory = FRESH_MEMORY
    position, attitude = position_init(setup.position, vehicle), attitude_init(setup.attitude, vehicle)
    first = observe(setup.plant, vehicle, plant)
    reference = TrajectoryPoint(0.0, first.p_w, zero, zero, zero, zero, 0.0, 0.0, 0.0)
    frozen = first
    mode, reason, k, max_tilt, climb, visited = 0, 0, 0, 0.0, 0.0, 0
    finite, touched, stopped = True, False, False
    while finite and not touched and not stopped and k < longest and (k < steps or mode == 1):
        state = observe(setup.plant, vehicle, plant)
        sample = seen_state(state, frozen, a, b, c, k)
        frozen = sample.state
        command = WrenchCommand(Wrench(0.0, zero), 0, False)
        if not setup.silent:
            if k % POSITION_STEPS == 0:
                seen = PositionInputs(state, reference, actuation)
                setpoint, position, _ = position_step(setup.position, vehicle, position, seen, POSITION_STEPS * dt)
            wrench, attitude, _ = attitude_step(
                setup.attitude, vehicle, attitude, AttitudeInputs(state, setpoint, actuation), dt
            )
            command = WrenchCommand(wrench, k, is_true(sample, state))
        inputs = Inputs(k, PERIOD, spoiled(command, a, b, c, k), sample, asked(a, b, c, k))
        flown, memory, report = guard_step(setup.guard, vehicle, memory, inputs, dt)
        mode, reason, stopped = report.status.mode, report.status.reason, report.status.stopped
        visited |= 1 << (mode * CONDITIONS + report.status.condition)
        finite = math.isfinite(flown.thrust + flown.torque_b.x + flown.torque_b.y + flown.torque_b.z)
        plant, actuation = plant_step(setup.plant, vehicle, plant, flown, setup.conditions, dt)
        after = observe(setup.plant, vehicle, plant)
        finite = finite and math.isfinite(norm(after.p_w) + norm(after.v_w) + norm(after.omega_b))
        lean = tilt_of(after)
        max_tilt = lean if lean > max_tilt else max_tilt
        climb = max(climb, after.p_w.z - first.p_w.z)
        touched = not setup.plant.ground.enabled and after.p_w.z <= FOOT
        k += 1
    end = observe(setup.plant, vehicle, plant)
    return Outcome(
        k, mode, reason, finite, touched, norm(end.v_w), tilt_of(end), max_tilt, end.p_w.z, climb, visited, stopped
    )


def tilt_of(state: VehicleState) -> float:
    """Return the angle in rad between body z and the vertical."""
    cosine = 1.0 - 2.0 * (state.q_wb.x * state.q_wb.x + state.q_wb.y * state.q_wb.y)
    if cosine >= 1.0:
        return 0.0
    return math.acos(cosine) if cosine > -1.0 else math.pi


def descent(setup: Setup, start: rigid_body.State, longest: int, gap: Fault = NO_FAULT, fly=faulty_flight) -> Outcome:
    """Return how a flight ends whose controller is silent from the first step on, and ``gap``; ``fly`` may be compiled.

    It ends at contact at the height of the feet, or with a ground when the guard has stopped the motors.
    """
    asked_at_once = Fault(DESCENT_ASKED, 0, 1)
    return fly(setup._replace(silent=True), start, asked_at_once, gap, NO_FAULT, longest, longest)
