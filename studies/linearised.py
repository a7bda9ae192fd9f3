"""The closed loop at hover as a matrix: what law, filters, prediction, delay, rotors and plant make of a small move.

All that one plant step hands to the next is the state x: the plant, the memories of laws and sensors, what they said
last, and the delay line. One period of the slowest part, run by the loop's own text from a hover, is the map x' = f(x);
central differences of ``size`` give its matrix A. The loop is stable where no eigenvalue of A is beyond 1 in size;
eigenvalues of 1 itself belong to numbers that nothing moves at hover, such as an adapted gain.

A law with sign() is not smooth: A is that of moves of this size.
"""

import math
from typing import Any

import numpy as np

from quad_core.cascade import STAGES
from quad_core.geometry import norm
from quad_dynamics.simulated_vehicle import RandomStreams, link_init
from quad_flight.engine import python_engine
from quad_flight.flight import Flight, from_names
from quad_flight.loop import Start, side_of, take_off
from quad_flight.stages import PerStage, Signals

SETTLED, SIZE, STABLE = 2.0, 1e-4, 1.0 + 1e-4
"""s of hover before the matrix is taken; size of the differences in SI units; largest eigenvalue of a stable loop."""
STILL = 1e-3  # rad/s: a hover that turns faster has left its equilibrium before the matrix could be taken
QUIET = [f"simulator.sensor.{name}_noise=1e-12" for name in ("position", "velocity", "attitude", "rate")]
"""Readings that never repeat: the prediction counts one that does as older."""


def hover(settings, **choices) -> Flight:
    """Return a hover in still air."""
    calm = ["simulator.guard.enabled=false", "simulator.disturbance=none", "trajectory.hover.start=printed", *QUIET]
    there = ["simulator.rigid_body.initial.p.z=2.0"]  # m: where the reference is
    return from_names("hover", settings=[*calm, *there, *settings], **choices)


def numbers(value: Any) -> list[float]:
    """Return the floats of nested NamedTuples, in order; whole numbers and flags are no state of a linear loop."""
    if isinstance(value, float):
        return [value]
    return [number for part in value for number in numbers(part)] if isinstance(value, tuple) else []


def with_numbers(value: Any, given: Any) -> Any:
    """Return ``value`` with its floats taken from the iterator ``given``."""
    if isinstance(value, float):
        return float(next(given))
    if not isinstance(value, tuple):
        return value
    parts = [with_numbers(part, given) for part in value]
    return value._make(parts) if hasattr(value, "_make") else tuple(parts)


def matrix(flight: Flight, size: float = SIZE) -> np.ndarray:
    """Return A of a hover, shape (states, states); NaN if it swings by itself: limits hide what grows."""
    setup, engine = flight.setup, python_engine(flight.modules)
    period = setup.schedule.plant_period
    line, sensing = flight.modules.sensing.init(setup.sensing, period)
    link_line, linked = link_init()
    laws = zip(flight.modules.stages, setup.stages, strict=True)
    memory = PerStage(*(module.init(own, setup.vehicle) for module, own in laws))
    start = Start(sensing, linked, memory, Signals(*(stage.output_type() for stage in STAGES)))
    steps = math.lcm(setup.schedule.trajectory_steps, *setup.schedule.stage_steps)
    settled = round(SETTLED * 1e9 / period) // steps * steps
    weather = flight.modules.disturbance.draw(setup.disturbance, setup.vehicle, 1, SETTLED + 1.0)
    drawn = RandomStreams(weather, flight.modules.sensing.draw(setup.sensing, 1, settled + steps), line, link_line)
    carry = engine.fly(setup, drawn, take_off(engine.functions, setup, drawn, start), settled, np.empty((0, 0)))
    turning = engine.functions.side.observe(side_of(setup), carry.side).omega_b
    if not norm(turning) < STILL:
        return np.full((1, 1), np.nan)
    late = max(sensing.ages)
    rows = [(carry.step - 1 - place) % len(line) for place in range(late)]
    later = [(row + steps) % len(line) for row in rows]
    parts = (carry.side, carry.memory, carry.signals)

    def after(state: np.ndarray) -> np.ndarray:
        given = iter(state)
        side, memory, signals = with_numbers(parts, given)
        own = line.copy()
        own[rows] = np.reshape(list(given), (late, line.shape[1]))
        moved = carry._replace(side=side, memory=memory, signals=signals)
        end = engine.fly(setup, drawn._replace(sensing_line=own), moved, steps, np.empty((0, 0)))
        return np.array([*numbers((end.side, end.memory, end.signals)), *own[later].flat])

    x = np.array([*numbers(parts), *line[rows].flat])
    moves = size * np.eye(len(x))
    return np.transpose([(after(x + move) - after(x - move)) / (2.0 * size) for move in moves])


def largest(flight: Flight, size: float = SIZE) -> float:
    """Return the largest size of an eigenvalue of a hover's A; infinite if it swings by itself or A is not finite."""
    found = matrix(flight, size)
    return float(np.abs(np.linalg.eigvals(found)).max()) if np.isfinite(found).all() else math.inf
