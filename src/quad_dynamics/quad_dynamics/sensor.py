"""Sensing ``sensor``: what the controllers see of the truth: bias, noise, rate, then delay.

Every ``period_steps`` plant steps a sample of the truth is taken; between samples the last one holds. Slower channels
take a new value from every n-th sample only. What each was ``delay`` s, and its own delay, ago is the `state`. A
sensor fault acts on the reading that comes out. With the defaults and without a fault the state is the truth, bit for
bit.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.cycle import seconds
from quad_core.geometry import add, rotated_by_vector
from quad_core.parameters import Real, Whole
from quad_core.types import Quat, SensorFault, Vec3, VehicleState, fresh, is_faulty, misread, with_ages

CHANNELS = 12
STREAM_FAMILY = 2
SLOTS = 512
"""Plant steps that the delay line holds."""


class Parameters(NamedTuple):
    """Errors of the state that controllers see.

    Noise is white from sample to sample, so its one-sided density is sd sqrt(2 T) with T s between samples. A bias is
    drawn once per flight and channel.
    """

    period_steps: Annotated[int, Whole("steps", "plant steps between two samples", 1, 10_000)] = 1
    delay: Annotated[float, Real("s", "age of a sample, rounded to plant steps, at most 511", 0.0, 10.0)] = 0.0
    position_delay: Annotated[float, Real("s", "age of the position in addition to `delay`", 0.0, 10.0)] = 0.0
    velocity_delay: Annotated[float, Real("s", "added age of the velocity", 0.0, 10.0)] = 0.0
    attitude_delay: Annotated[float, Real("s", "added age of the attitude", 0.0, 10.0)] = 0.0
    rate_delay: Annotated[float, Real("s", "added age of the body rates", 0.0, 10.0)] = 0.0
    age_error: Annotated[float, Real("s", "age that a late state says, at least 0, minus its own", -10.0, 10.0)] = 0.0
    position_every: Annotated[int, Whole("", "position, velocity change every so many samples", 1, 10_000)] = 1
    attitude_every: Annotated[int, Whole("", "the attitude changes every so many samples; 1: each", 1, 10_000)] = 1
    rate_every: Annotated[int, Whole("", "the body rates change every so many samples; 1: each", 1, 10_000)] = 1
    position_noise: Annotated[float, Real("m", "standard deviation of the position noise", 0.0, 100.0)] = 0.0
    position_bias: Annotated[float, Real("m", "standard deviation of the position bias", 0.0, 100.0)] = 0.0
    velocity_noise: Annotated[float, Real("m/s", "standard deviation of the velocity noise", 0.0, 100.0)] = 0.0
    velocity_bias: Annotated[float, Real("m/s", "standard deviation of the velocity bias", 0.0, 100.0)] = 0.0
    attitude_noise: Annotated[float, Real("rad", "standard deviation of the noise about each axis", 0.0, 1.0)] = 0.0
    attitude_bias: Annotated[float, Real("rad", "standard deviation of the bias about each axis", 0.0, 1.0)] = 0.0
    rate_noise: Annotated[float, Real("rad/s", "standard deviation of the body rate noise", 0.0, 100.0)] = 0.0
    rate_bias: Annotated[float, Real("rad/s", "standard deviation of the body rate bias", 0.0, 100.0)] = 0.0


class Ages(NamedTuple):
    """Ages of the channels in plant steps when they are seen."""

    position: int
    velocity: int
    attitude: int
    rate: int


class Memory(NamedTuple):
    """The last sample and the reading of a frozen sensor; ``late``: some channel has an age. ``period`` in ns."""

    active: bool
    late: bool
    ages: Ages
    period: int
    last_sample: VehicleState
    frozen: bool
    reading: VehicleState


def draw(parameters: Parameters, seed: int, steps: int) -> NDArray[np.float64]:
    """Return the random numbers of ``steps`` plant steps, shape (1 + samples, 12): standard normals.

    Row 0 is for the biases; then a row per sample. Each channel has its own stream of (seed, channel): a longer table
    begins like a shorter one.
    """
    samples = (steps - 1) // parameters.period_steps + 1 if is_active(parameters) else 0
    table = np.zeros((1 + samples, CHANNELS))
    if samples:
        for channel in range(CHANNELS):
            stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM_FAMILY, channel)))
            table[:, channel] = stream.standard_normal(1 + samples)
    return table


def is_active(parameters: Parameters) -> bool:
    """Return whether the state can differ from the truth without a fault."""
    return parameters != Parameters()


def init(parameters: Parameters, plant_period: int) -> tuple[NDArray[np.float64], Memory]:
    """Return the delay line (a row per plant step) and the memory before step 0.

    Raises ValueError if the line is too short for the delay.
    """
    ages = Ages(*(_steps(parameters, name, plant_period) for name in Ages._fields))
    memory = Memory(is_active(parameters), max(ages) > 0, ages, plant_period, VehicleState(), False, VehicleState())
    return np.zeros((SLOTS, 13)), memory


def _steps(parameters: Parameters, channel: str, plant_period: int) -> int:
    name = f"{channel}_delay"
    delay: float = parameters.delay + getattr(parameters, name)
    steps = math.floor(delay / seconds(1, plant_period) + 0.5)
    if steps >= SLOTS:
        raise ValueError(f"delay and {name}: found {steps} plant steps, expected at most {SLOTS - 1}")
    return steps


def step(
    parameters: Parameters,
    table: NDArray[np.float64],
    line: NDArray[np.float64],
    memory: Memory,
    truth: VehicleState,
    fault: SensorFault,
    k: int,
) -> tuple[VehicleState, Memory]:
    """Return the state seen at plant step ``k``, and the memory. Writes to the delay ``line``."""
    if not memory.active and not memory.frozen and not is_faulty(fault):
        return truth, memory
    last_sample = memory.last_sample
    reading = truth
    if memory.active:
        if k % parameters.period_steps == 0:
            row = 1 + k // parameters.period_steps
            if row > len(table) - 1:
                row = len(table) - 1
            last_sample = renewed(parameters, last_sample, sampled(parameters, table, row, truth), row - 1)
        reading = last_sample
        if memory.late:
            put(line, k % SLOTS, last_sample)
            reading = aged(line, memory.ages, memory.period, parameters.age_error, k)
    reading = misread(reading, fault)
    if fault.frozen and memory.frozen:
        reading = memory.reading
    return reading, Memory(memory.active, memory.late, memory.ages, memory.period, last_sample, fault.frozen, reading)


def sampled(parameters: Parameters, table: NDArray[np.float64], row: int, truth: VehicleState) -> VehicleState:
    """Return one sample of ``truth`` with the errors of table row ``row``."""
    turn = errors(table, row, 6, parameters.attitude_bias, parameters.attitude_noise)
    q = truth.q_wb
    if turn.x != 0.0 or turn.y != 0.0 or turn.z != 0.0:
        q = rotated_by_vector(q, turn)
    position = errors(table, row, 0, parameters.position_bias, parameters.position_noise)
    velocity = errors(table, row, 3, parameters.velocity_bias, parameters.velocity_noise)
    rates = errors(table, row, 9, parameters.rate_bias, parameters.rate_noise)
    return fresh(add(truth.p_w, position), add(truth.v_w, velocity), q, add(truth.omega_b, rates))


def renewed(parameters: Parameters, last: VehicleState, sample: VehicleState, number: int) -> VehicleState:
    """Return sample ``number``, with what is not due in it as it was ``last``; all is due in the first."""
    if number == 0:
        return sample
    position, velocity, attitude, rate = sample.p_w, sample.v_w, sample.q_wb, sample.omega_b
    if number % parameters.position_every != 0:
        position, velocity = last.p_w, last.v_w
    if number % parameters.attitude_every != 0:
        attitude = last.q_wb
    if number % parameters.rate_every != 0:
        rate = last.omega_b
    return fresh(position, velocity, attitude, rate)


def errors(table: NDArray[np.float64], row: int, first: int, bias: float, noise: float) -> Vec3:
    """Return bias and noise of three channels from ``first``, in the unit of both standard deviations."""
    return Vec3(
        bias * float(table[0, first]) + noise * float(table[row, first]),
        bias * float(table[0, first + 1]) + noise * float(table[row, first + 1]),
        bias * float(table[0, first + 2]) + noise * float(table[row, first + 2]),
    )


def put(line: NDArray[np.float64], slot: int, state: VehicleState) -> None:
    """Write ``state`` into a row of the delay line."""
    line[slot, 0], line[slot, 1], line[slot, 2] = state.p_w.x, state.p_w.y, state.p_w.z
    line[slot, 3], line[slot, 4], line[slot, 5] = state.v_w.x, state.v_w.y, state.v_w.z
    line[slot, 6], line[slot, 7] = state.q_wb.x, state.q_wb.y
    line[slot, 8], line[slot, 9] = state.q_wb.z, state.q_wb.w
    line[slot, 10], line[slot, 11], line[slot, 12] = state.omega_b.x, state.omega_b.y, state.omega_b.z


def aged(line: NDArray[np.float64], ages: Ages, period: int, error: float, k: int) -> VehicleState:
    """Return each channel as it was its age before plant step ``k``, and that age with its ``error`` in s.

    Before step 0 it was as then.
    """
    p, v = slot_of(k, ages.position), slot_of(k, ages.velocity)
    q, w = slot_of(k, ages.attitude), slot_of(k, ages.rate)
    late = fresh(
        Vec3(float(line[p, 0]), float(line[p, 1]), float(line[p, 2])),
        Vec3(float(line[v, 3]), float(line[v, 4]), float(line[v, 5])),
        Quat(float(line[q, 6]), float(line[q, 7]), float(line[q, 8]), float(line[q, 9])),
        Vec3(float(line[w, 10]), float(line[w, 11]), float(line[w, 12])),
    )
    return with_ages(
        late,
        max(0.0, seconds(ages.position, period) + error),
        max(0.0, seconds(ages.velocity, period) + error),
        max(0.0, seconds(ages.attitude, period) + error),
        max(0.0, seconds(ages.rate, period) + error),
    )


def slot_of(k: int, age: int) -> int:
    """Return the row of the delay line that holds what was taken ``age`` plant steps before step ``k``."""
    old = k - age
    if old < 0:
        old = 0
    return old % SLOTS
