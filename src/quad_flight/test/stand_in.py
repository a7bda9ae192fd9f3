"""Tiny plug-ins, one for every group: a point mass that a proportional law holds; quick to compile."""

import math
from typing import Annotated, NamedTuple

import numpy as np

from quad_core.cycle import as_disturbance
from quad_core.node_parameters import GuardParameters
from quad_core.parameters import Real
from quad_core.types import (
    CALM,
    Actuation,
    AttitudeThrust,
    Conditions,
    Quat,
    Rotors,
    TrajectoryPoint,
    Vec3,
    VehicleState,
    Wrench,
)
from quad_core.vehicle import Vehicle
from quad_flight.engine import Modules
from quad_flight.flight import Flight
from quad_flight.loop import Schedule, Setup
from quad_flight.stages import PerStage


class Parameters(NamedTuple):
    """One number for whatever the stand-in does with it."""

    gain: Annotated[float, Real("", "gain, or duration of the trajectory in s", -1e9, 1e9)] = 1.0


class Memory(NamedTuple):
    """Counts the law's steps."""

    count: float = 0.0


class SensorMemory(NamedTuple):
    """Active, so that every step is asked for."""

    active: bool = True
    frozen: bool = False


class Internals(NamedTuple):
    """What the law saw."""

    dt: float = 0.0
    thrust_before: float = 0.0


class State(NamedTuple):
    """Height and climb."""

    z: float = 0.0
    vz: float = 0.0


class Plan(NamedTuple):
    """Nothing to plan."""

    lead: float = 0.0


_ZERO = Vec3(0.0, 0.0, 0.0)
_LEVEL = Quat(0.0, 0.0, 0.0, 1.0)


class plant:  # noqa: N801
    """Height under thrust per unit mass."""

    @staticmethod
    def init(parameters, vehicle):
        return State(0.0, 0.0)

    @staticmethod
    def step(parameters, vehicle, state, wrench, conditions, dt):
        vz = state.vz + dt * (wrench.thrust + conditions.force_w.z)
        none = Rotors(0.0, 0.0, 0.0, 0.0)
        actuation = Actuation(none, none, wrench.thrust, wrench.torque_b, False, False, False, False, False)
        return State(state.z + dt * vz, vz), actuation

    @staticmethod
    def observe(parameters, vehicle, state):
        return VehicleState(Vec3(0.0, 0.0, state.z), Vec3(0.0, 0.0, state.vz), _LEVEL, _ZERO)

    @staticmethod
    def lumped(parameters, vehicle, state, wrench, conditions):
        return as_disturbance(conditions, Vec3(0.0, 0.0, wrench.thrust), Vec3(0.0, 0.0, state.z))


class disturbance:  # noqa: N801
    """A constant push upwards of seed / 1000."""

    @staticmethod
    def draw(parameters, vehicle, seed, duration):
        return np.full((1, 6), seed * 1e-3)

    @staticmethod
    def sample(parameters, table, time):
        return Conditions(Vec3(0.0, 0.0, float(table[0, 2])), _ZERO, *CALM[2:])


class sensing:  # noqa: N801
    """The truth."""

    @staticmethod
    def draw(parameters, seed, steps):
        return np.zeros((1, 1))

    @staticmethod
    def init(parameters, plant_period):
        return np.zeros((1, 1)), SensorMemory(True, False)

    @staticmethod
    def step(parameters, table, line, memory, truth, fault, k):
        return truth, memory


class trajectory:  # noqa: N801
    """Height 1 m; ``gain`` is the duration; 20 ms of lead-in."""

    @staticmethod
    def plan(parameters, vehicle, start):
        return Plan(0.02)

    @staticmethod
    def sample(parameters, plan, time):
        return TrajectoryPoint(time - plan.lead, Vec3(0.0, 0.0, 1.0), _ZERO, _ZERO, _ZERO, _ZERO, 0.0, 0.0, 0.0)

    @staticmethod
    def duration(parameters, plan):
        return plan.lead + parameters.gain


class position:  # noqa: N801
    """Thrust from the height error and the climb; not a number if ``gain`` is negative, after 4 steps."""

    name = "stand_in.position"
    Memory, Internals = Memory, Internals

    @staticmethod
    def init(parameters, vehicle):
        return Memory(0.0)

    @staticmethod
    def step(parameters, vehicle, memory, inputs, dt):
        error = inputs.reference.p_w.z - inputs.state.p_w.z
        thrust = parameters.gain * error - 2.0 * inputs.state.v_w.z
        if parameters.gain < 0.0 and memory.count >= 4.0:
            thrust = float("nan")
        seen = Internals(dt, inputs.actuation.thrust)
        return AttitudeThrust(_ZERO, _ZERO, _ZERO, _LEVEL, thrust, 0.0), Memory(memory.count + 1.0), seen


class attitude:  # noqa: N801
    """Passes the thrust on, ``gain`` times; remembers infinity from the seventh answer on if ``gain`` is 0."""

    name = "stand_in.attitude"
    Memory, Internals = Memory, Internals

    @staticmethod
    def init(parameters, vehicle):
        return Memory(0.0)

    @staticmethod
    def step(parameters, vehicle, memory, inputs, dt):
        seen = Internals(dt, inputs.actuation.thrust)
        count = memory.count + 1.0
        if parameters.gain == 0.0 and count > 6.0:
            count = math.inf
        return Wrench(parameters.gain * inputs.setpoint.thrust, _ZERO), Memory(count), seen


MODULES = Modules(
    plant, disturbance, trajectory, sensing, PerStage(position_controller=position, attitude_controller=attitude)
)


def small_flight(seed=0, duration=0.08, position=4.0, attitude=1.0, steps=(5, 10, 2), modules=MODULES):
    schedule = Schedule(2_000_000, steps[0], PerStage(*steps[1:]), 0.0)
    laws = PerStage(Parameters(position), Parameters(attitude))
    shown = PerStage(Internals(), Internals())
    one = Parameters(1.0)
    # a point mass is no vehicle that a guard could judge
    unguarded = GuardParameters(enabled=False)
    setup = Setup(Vehicle(), schedule, one, one, Parameters(duration), one, laws, shown, unguarded)
    return Flight(modules, setup, seed, {})


def with_stages(**stages):
    return MODULES._replace(stages=MODULES.stages._replace(**stages))
