"""What one step of each law costs: in CPython, compiled by Numba, and in a node with checks and internals."""

import time
from types import FunctionType
from typing import Any

import numpy as np
from table import Row

from quad_core import plugins
from quad_core.compilation import compiled
from quad_core.geometry import quaternion_from_euler
from quad_core.records import finite_check, flattener
from quad_core.types import (
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    PositionInputs,
    Quat,
    TrajectoryPoint,
    Vec3,
    VehicleState,
    Wrench,
)
from quad_core.vehicle import Vehicle

BENCH = "laws"
_PLAIN, _COMPILED = 5_000, 500_000
_STATES = 500
_PERIODS = {plugins.POSITION_LAW: 0.01, plugins.ATTITUDE_LAW: 0.002}
_OUTPUT = {plugins.POSITION_LAW: AttitudeThrust, plugins.ATTITUDE_LAW: Wrench}
_WANTED = {plugins.POSITION_LAW: TrajectoryPoint(), plugins.ATTITUDE_LAW: AttitudeThrust(thrust=20.0)}


def measure(rounds: int) -> list[Row]:
    """Return the costs of a step of every registered law with its default gains, near hover."""
    rows = []
    for group, dt in _PERIODS.items():
        names = {"Inputs": PositionInputs, "figure": thrust}
        if group == plugins.ATTITUDE_LAW:
            names = {"Inputs": AttitudeInputs, "figure": roll_torque}
        for name in plugins.names(group):
            law = plugins.load(group, name)
            bound = FunctionType(law_steps.__code__, {**globals(), **names, "step": law.step}, law_steps.__name__)
            fast = compiled(bound)
            plain = tuple(1e6 * _cost(bound, law, _WANTED[group], _PLAIN, dt) for _ in range(rounds))
            _cost(fast, law, _WANTED[group], 1, dt)
            quick = tuple(1e9 * _cost(fast, law, _WANTED[group], _COMPILED, dt) for _ in range(rounds))
            node = tuple(1e6 * _cost_in_a_node(group, law, names["Inputs"], dt) for _ in range(rounds))
            label = f"{group.removeprefix('quad.')} {name}"
            rows += [
                Row(BENCH, f"{label}: CPython", plain, "us/step"),
                Row(BENCH, f"{label}: compiled", quick, "ns/step"),
                Row(BENCH, f"{label}: in a node", node, "us/step", "", "inputs, output, internals handed over"),
            ]
    return rows


def _cost(spin: Any, law: Any, setpoint: Any, count: int, dt: float) -> float:
    parameters, vehicle = law.Parameters(), Vehicle()
    memory, table = law.init(parameters, vehicle), states()
    began = time.perf_counter()
    total = spin(parameters, vehicle, memory, table, setpoint, Actuation(), count, dt)
    took = time.perf_counter() - began
    if not np.isfinite(total):
        raise RuntimeError(f"{law.__name__}: not finite")
    return took / count


def _cost_in_a_node(group: str, law: Any, inputs: Any, dt: float) -> float:
    """Return the time in s of what ``LawNode`` does for a step, without messages."""
    parameters, vehicle, table = law.Parameters(), Vehicle(), states()
    memory, flat = law.init(parameters, vehicle), flattener(law.Internals)
    output_finite, memory_finite = finite_check(_OUTPUT[group]), finite_check(law.Memory)
    values = [inputs(state_of(table, k), _WANTED[group], Actuation()) for k in range(_STATES)]
    began = time.perf_counter()
    for k in range(_PLAIN):
        output, memory, internals = law.step(parameters, vehicle, memory, values[k % _STATES], dt)
        if not (output_finite(output) and memory_finite(memory)):
            raise RuntimeError(f"{law.__name__}: not finite")
        flat(internals)
    return (time.perf_counter() - began) / _PLAIN


def states() -> np.ndarray:
    """Return random states near hover: position, velocity, attitude xyzw and body rates in each row."""
    rng = np.random.default_rng(1)
    table = rng.normal(scale=0.05, size=(_STATES, 13))
    for row in table:
        row[6:10] = quaternion_from_euler(Vec3(*rng.normal(scale=0.1, size=3).tolist()))
    return table


def state_of(table: Any, k: int) -> VehicleState:
    """Return the state in row ``k``."""
    row = table[k]
    return VehicleState(
        Vec3(row[0], row[1], row[2]),
        Vec3(row[3], row[4], row[5]),
        Quat(row[6], row[7], row[8], row[9]),
        Vec3(row[10], row[11], row[12]),
    )


def law_steps(
    parameters: Any, vehicle: Any, memory: Any, table: Any, setpoint: Any, actuation: Any, count: int, dt: float
) -> float:
    """Return the sum of a figure over ``count`` answers; ``measure`` binds ``step``, ``Inputs`` and ``figure``."""
    total = 0.0
    for k in range(count):
        inputs = Inputs(state_of(table, k % len(table)), setpoint, actuation)  # type: ignore[name-defined]  # noqa: F821
        answer, memory, _ = step(parameters, vehicle, memory, inputs, dt)  # type: ignore[name-defined]  # noqa: F821
        total += figure(answer)  # type: ignore[name-defined]  # noqa: F821
    return total


def thrust(answer: Any) -> float:
    """Return the thrust of a position law's answer."""
    return answer.thrust


def roll_torque(answer: Any) -> float:
    """Return the roll torque of an attitude law's answer, which hands the thrust through."""
    return answer.torque_b.x
