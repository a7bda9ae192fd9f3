"""Flights of the guard without ROS, over the plant ``rigid_body``; one text for CPython and Numba."""

import math
from pathlib import Path
from typing import NamedTuple

from quad_core.geometry import norm, quaternion_from_euler
from quad_core.guard_parameters import GuardParameters
from quad_core.parameter_files import overrides_for, read_parameter_file
from quad_core.parameters import build
from quad_core.types import Conditions, Quat, Rotors, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics.parameters import Ground, PlantParameters
from quad_dynamics.rigid_body import State, observe, step
from quad_dynamics.rotors import rotor_speed
from quad_guard import guard
from quad_guard.checks import StateSample, WrenchCommand
from quad_guard.guard import Inputs

PERIOD = 2_000_000
FOOT = 0.1
VEHICLES = Path(__file__).parents[1] / "src" / "quad_flight" / "quad_flight" / "config" / "vehicles"

guard_init, guard_step = guard.init, guard.step


class Ending(NamedTuple):
    """How a descent ended: steps flown, contact made, speed m/s and tilt rad then, mode, finite, off, height m.

    ``climb``: largest height above the start in m.
    """

    steps: int
    touched: bool
    speed: float
    tilt: float
    mode: int
    finite: bool
    stopped: bool
    height: float
    climb: float


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
    return State(motion, Rotors(turning, turning, turning, turning))


def descent(
    guard_parameters: GuardParameters,
    plant: PlantParameters,
    vehicle: Vehicle,
    start: State,
    longest: int,
    gap_begin: int,
    gap_end: int,
    conditions: Conditions,
) -> Ending:
    """Return how a flight ends whose controller is silent from the first step on; contact at the height of the feet.

    No state arrives from step ``gap_begin`` until before ``gap_end``. ``conditions`` act at every step.
    """
    zero = Vec3(0.0, 0.0, 0.0)
    none = WrenchCommand(Wrench(0.0, zero), 0, 0, False, False)
    memory = guard_init(guard_parameters, vehicle)
    state = start
    k = 0
    dt = PERIOD / 1e9
    report_mode, stopped, touched, finite, climb = 0, False, False, True, 0.0
    while k < longest and not touched and finite and not stopped:
        seen = observe(plant, vehicle, state)
        request = 2 if k == 0 else 0
        inputs = Inputs(k, PERIOD, none, StateSample(seen, k, k * PERIOD, not gap_begin <= k < gap_end, True), request)
        wrench, memory, report = guard_step(guard_parameters, vehicle, memory, inputs, dt)
        report_mode, stopped = report.mode, report.stopped
        finite = math.isfinite(wrench.thrust + wrench.torque_b.x + wrench.torque_b.y + wrench.torque_b.z)
        if finite:
            state, _ = step(plant, vehicle, state, wrench, conditions, dt)
            p, q, omega = state.motion.p_w, state.motion.q_wb, state.motion.omega_b
            finite = math.isfinite(p.x + p.y + p.z + q.x + q.y + q.z + omega.x)
            climb = max(climb, p.z - start.motion.p_w.z)
        touched = not plant.ground.enabled and observe(plant, vehicle, state).p_w.z <= FOOT
        k += 1
    end = observe(plant, vehicle, state)
    cosine = 1.0 - 2.0 * (end.q_wb.x * end.q_wb.x + end.q_wb.y * end.q_wb.y)
    speed = norm(end.v_w)
    tilt = math.acos(cosine) if -1.0 < cosine < 1.0 else (0.0 if cosine > 0.0 else math.pi)
    return Ending(k, touched, speed, tilt, report_mode, finite, stopped, end.p_w.z, climb)


def on_ground(parameters: PlantParameters) -> PlantParameters:
    """Return the plant with a ground at height 0."""
    return parameters._replace(ground=Ground(True, 0.0, FOOT, 0.8))
