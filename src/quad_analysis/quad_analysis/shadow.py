"""What another pair of laws would have commanded on a recorded flight, next to what was flown, axis by axis.

The position law answers the recorded states and references, the attitude law the set points of that position law. On
bags of ours each step is that of the node (``replay``); on imported ones both laws answer every state with a reference.
"""

from collections.abc import Mapping
from functools import lru_cache
from itertools import permutations
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from quad_analysis.arrays import Floats, by_stamp, euler_angles, wrapped
from quad_analysis.refly import IDLE, LONGEST_GAP, flown_wrench, held_at, phases_of
from quad_analysis.replay import answered, by_step, columns_of, seen_on_board, tuples_of
from quad_analysis.tables import PARAMETERS
from quad_analysis.text import aligned
from quad_core.cascade import POSITION, STAGE
from quad_core.parameters import Value
from quad_core.types import AttitudeThrust, Quat, TrajectoryPoint, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics.rotors import allocate_within, rotor_limit
from quad_flight_log.errors import FlightLogError, TopicError
from quad_flight_log.reader import Flight

AXES = {
    "roll": ("attitude_setpoint angles.x", "deg", "position_controller tilt_limited"),
    "pitch": ("attitude_setpoint angles.y", "deg", "position_controller tilt_limited"),
    "yaw": ("attitude_setpoint angles.z", "deg", ""),
    "thrust": ("attitude_setpoint thrust", "N", "position_controller thrust_limited"),
    "torque x": ("wrench_setpoint torque_b.x", "N m", "attitude_controller torque_limited.x"),
    "torque y": ("wrench_setpoint torque_b.y", "N m", "attitude_controller torque_limited.y"),
    "torque z": ("wrench_setpoint torque_b.z", "N m", "attitude_controller torque_limited.z"),
}
"""{axis: (number of the pair's answers, unit, flag of its limit)}."""
EXCHANGED = (("roll", "pitch"), ("torque x", "torque y", "torque z"))
TILT, THRUST = 35.0, 0.5  # the envelope: tilt in deg, and by which part of the weight thrust may differ from it
ANEW = 1_000_000_000  # ns after which the memory begins again
LONGEST_LAG = 0.25  # s
TARGET = "attitude_target"
"""The topic of an imported bag with the set points that the autopilot's own attitude loop follows."""
ALIKE, UNLIKE, SCALES = 0.8, 0.5, (0.5, 2.0)
"""Correlation from which on two signals are alike, below which not, and ratios of their RMS that are no mistake."""

Numbers = dict[str, tuple[Any, Any]]  # {number: (stamps ns, values)}


class Beside(NamedTuple):
    """Laws and a flight. ``axes``: {axis: (times s, flown, shadow)}, ``saturated``: {axis: share of the steps}.

    ``weight`` in N. ``equal``: whether every bit of the recorded answers was given again.
    """

    laws: list[str]
    axes: dict[str, tuple[Floats, Floats, Floats]]
    saturated: dict[str, float]
    weight: float
    equal: bool
    notes: list[str]


def shadow(
    flight: Flight,
    laws: Mapping[str, str | None],
    values: dict[str, Value],
    gains: Mapping[str, dict[str, Value]] = MappingProxyType({}),
    *,
    anew: bool,
) -> Beside:
    """Return what ``laws``, {role: law, None: the one that flew}, would have commanded; ``anew``: see ANEW.

    ``values``: {vehicle.*: value} instead of those recorded, ``gains``: {role: {parameter: value}} likewise. Raises
    FlightLogError naming what the bag lacks.
    """
    lacks = {"reference": "the laws have nothing to follow", "state": "position, velocity, attitude, rates are needed"}
    for topic, so in lacks.items():
        if not flight.has(topic):
            raise TopicError(f"{flight.path}: no {topic}: {so}")
    phases = {role: phases_of(flight, role, laws.get(role), values | gains.get(role, {})) for role in STAGE}
    first = next(iter(phases.values()))[0][1]
    given, flown, said, notes = dict[str, Mapping[int, Any]](), Numbers(), Numbers(), list[str]()
    others = None if flight.has(PARAMETERS) else _imported(flight, first.vehicle)
    if others:
        given, flown, notes = dict(others.inputs), others.flown, list(others.notes)
    for role, stage in STAGE.items():
        if others:
            had = ((others.states[row], *(given[each.topic][row] for each in stage.inputs)) for row in others.rows)
            inputs = map(stage.inputs_type._make, had)
            seen = [(*each, True) for each in zip(others.rows, others.dt, inputs, strict=True)]
        else:
            seen = list(seen_on_board(phases[role][0][1], stage, flight, given))
        steps = np.array([each[0] for each in seen])
        stamps = others.stamps if others else steps * first.flight.plant_period
        begun = set(steps[np.unique((stamps - stamps[:1]) // ANEW, return_index=True)[1]].tolist()) if anew else set()
        found = answered(phases[role], seen, begun | others.gaps if others else begun)
        given.setdefault(stage.output, dict(zip(found.steps, found.outputs, strict=True)))
        said |= _numbers(stage.output, stamps, found.outputs) | _numbers(role, stamps, found.internals)
        if not others:
            recorded = by_step(flight, stage.output, first.flight.plant_period)
            there = first.flight.plant_period * np.array(list(recorded))
            flown |= _numbers(stage.output, there, list(recorded.values()))
        if found.incomplete:
            notes.append(f"{role}: at {found.incomplete} steps an input that the law had was not recorded")
    axes, weight = {}, first.vehicle.mass * first.vehicle.gravity
    for name, (number, unit, _) in AXES.items():
        common, one, other = np.intersect1d(flown[number][0], said[number][0], return_indices=True)
        factor = np.degrees(1.0) if unit == "deg" else 1.0
        was, would = factor * flown[number][1][one], factor * said[number][1][other]
        if name == "yaw":  # no jump of a whole turn in one of the two
            was, would = np.unwrap(was, period=360.0), would - was
            would = was + np.degrees(wrapped(np.radians(would)))
        axes[name] = (common * 1e-9, was, would)
    saturated = {name: float(said[flag][1].mean()) for name, (_, _, flag) in AXES.items() if flag in said}
    equal = all(column.tobytes() == said[name][1].tobytes() for name, (_, column) in flown.items())
    names = [phase[0][1].plugins["law"].name for phase in phases.values()]
    return Beside(names, axes, saturated, weight, equal, notes)


class Imported(NamedTuple):
    """What an imported bag has at the rows of ``state`` in flight with a reference, and which of them follow a gap."""

    rows: list[int]
    stamps: Any
    gaps: set[int]
    dt: list[float]
    states: list[VehicleState]
    inputs: dict[str, Mapping[int, Any]]
    flown: Numbers
    notes: list[str]


@lru_cache(1)  # the same for both memories
def _imported(flight: Flight, vehicle: Vehicle) -> Imported:
    table, references = (by_stamp(flight.array(topic)) for topic in ("state", "reference"))
    stamps, states = table["stamp_ns"], tuples_of(VehicleState, table, f"{flight.path}: state")
    points = tuples_of(TrajectoryPoint, references, f"{flight.path}: reference")
    known = dict(zip(references["stamp_ns"].tolist(), points, strict=True))
    wrench = held_at(*flown_wrench(flight, vehicle), stamps)
    idle = wrench[:, 0] < IDLE * vehicle.mass * vehicle.gravity
    without = np.array([stamp not in known for stamp in stamps.tolist()])
    rows = np.flatnonzero(~idle & ~without)
    if len(rows) < 2:
        raise FlightLogError(f"{flight.path}: no reference: no two states in flight have one")
    steps = np.diff(stamps, append=stamps[-1:]) * 1e-9
    dt, usual = np.diff(stamps[rows], prepend=0) * 1e-9, float(np.median(steps))
    late = dt > LONGEST_GAP * usual
    dt[late] = usual
    before = (Wrench(up, Vec3(*turn)) for up, *turn in wrench[np.maximum(rows - 1, 0)].tolist())
    inputs: dict[str, Mapping[int, Any]] = {
        "reference": {row: known[int(stamps[row])] for row in rows.tolist()},
        "actuation": {
            row: allocate_within(vehicle, each, rotor_limit(vehicle))
            for row, each in zip(rows.tolist(), before, strict=True)
        },
    }
    q, whose = table["q_wb"][rows], "those of the vehicle, which follows a set point late"
    if flight.has(TARGET):
        asked = by_stamp(flight.array(TARGET))
        q = np.column_stack([asked["quaternion"][name] for name in "xyzw"])
        q, whose = (
            held_at(asked["stamp_ns"], q, stamps)[rows],
            "the autopilot's set points, and the attitude law has them",
        )
    columns = np.column_stack([euler_angles(q), wrench[rows]])
    if flight.has(TARGET):
        inputs[STAGE[POSITION].output] = {
            row: AttitudeThrust(angles=Vec3(*each[:3]), q_wb=Quat(*turned), thrust=each[3])
            for row, each, turned in zip(rows.tolist(), columns.tolist(), q.tolist(), strict=True)
        }
    flown = {axis[0]: (stamps[rows], column) for axis, column in zip(AXES.values(), columns.T, strict=True)}
    lacking = [steps[part].sum() for part in (without, idle & ~without, slice(None))]
    notes = [
        "left out: {:.1f} s without a reference, {:.1f} s with idle motors, of {:.1f} s".format(*lacking),
        f"flown roll, pitch and yaw are {whose}",
    ]
    return Imported(rows.tolist(), stamps[rows], set(rows[late].tolist()), dt.tolist(), states, inputs, flown, notes)


def _numbers(name: str, stamps: Any, items: list[Any]) -> Numbers:
    return {f"{name} {leaf}": (stamps, column) for leaf, column in columns_of(type(items[0]), items).items()}


def correlation(one: Floats, other: Floats) -> float:
    """Return the correlation of two signals; NaN if one does not move."""
    moves = all(np.ptp(each) > 1e-9 * max(float(np.abs(each).max()), 1e-9) for each in (one, other))
    return float(np.corrcoef(one, other)[0, 1]) if moves else float("nan")


def lag(t: Floats, flown: Floats, said: Floats) -> float:
    """Return by how many s, up to LONGEST_LAG, ``said`` follows ``flown``: where they correlate best."""
    step = float(np.median(np.diff(t)))
    even = np.arange(t[0], t[-1], step)
    a, b = (np.interp(even, t, part - part.mean()) for part in (said, flown))
    size, reach = 2 * len(even), min(round(LONGEST_LAG / step), len(even) - 1)
    both = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)
    return float((int(np.argmax(np.roll(both, reach)[: 2 * reach + 1])) - reach) * step)


def lines(carried: Beside, anew: Beside) -> list[str]:
    """Return what to print of a pair with its memory carried from the first step on, and begun anew every second."""
    verdict = ": every bit is that of the flight" * carried.equal
    out = [f"shadow: {', '.join(carried.laws)}{verdict}", *carried.notes]
    for name, each in (("carried from the first step on", carried), ("begun anew every second", anew)):
        out += [f"\nshadow less flown, memory {name}", aligned(_rows(each), range(2, 9)), _envelope(each)]
    return [*out, "", *(mistakes(anew) or ["no mistake of sign, scale or frame shows"])]


def _rows(beside: Beside) -> list[list[str]]:
    rows = [["axis", "unit", "mean", "RMS", "RMS flown", "ratio", "correlation", "lag", "saturated"]]
    for name, (t, flown, said) in beside.axes.items():
        gap, alike = said - flown, correlation(flown, said)
        numbers = [gap.mean(), np.sqrt(np.mean(gap**2)), np.sqrt(np.mean(flown**2))]
        cells = [f"{said.std() / flown.std():.2f}", f"{alike:.3f}"] if np.isfinite(alike) else ["-", "-"]
        cells.append(f"{1e3 * lag(t, flown, said):.0f} ms" if alike > UNLIKE else "-")
        share = f"{100.0 * beside.saturated[name]:.1f} %" if name in beside.saturated else "-"
        rows.append([name, AXES[name][1], *(f"{number:.3g}" for number in numbers), *cells, share])
    return rows


def _envelope(beside: Beside) -> str:
    """Return when shadow and flight first left the envelope."""
    parts, t = [], beside.axes["roll"][0]
    for who, at in (("shadow", 2), ("flown", 1)):
        roll, pitch = (np.radians(beside.axes[name][at]) for name in ("roll", "pitch"))
        tilt, thrust = np.degrees(np.arccos(np.cos(roll) * np.cos(pitch))), beside.axes["thrust"][at] / beside.weight
        out = np.flatnonzero((tilt > TILT) | (np.abs(thrust - 1.0) > THRUST))[:1]
        where = [f"{t[k] - t[0]:.2f} s ({tilt[k]:.0f} deg, {thrust[k]:.2f} of the weight)" for k in out]
        parts.append(f"{who} leaves it at {where[0]}" if where else f"{who} stays in it")
    return f"envelope, tilt {TILT:g} deg, thrust {1 - THRUST:g} to {1 + THRUST:g} of the weight: {'; '.join(parts)}"


def mistakes(beside: Beside) -> list[str]:
    """Return what the axes betray of sign, scale and frame, a line each."""
    out, axes = [], beside.axes
    for name, (_, flown, said) in axes.items():
        alike, ratio = correlation(flown, said), said.std() / max(flown.std(), 1e-12)
        if alike < -ALIKE:
            out.append(f"sign? {name}: the shadow does the opposite of what was flown (correlation {alike:.2f})")
        if abs(alike) > ALIKE and not SCALES[0] < ratio < SCALES[1]:
            out.append(f"scale? {name}: the shadow is {ratio:.3g} times what was flown (correlation {alike:.2f})")
    mean = axes["thrust"][2].mean() / max(float(axes["thrust"][1].mean()), 1e-12)
    if not 0.8 < mean < 1.25:
        out.append(f"scale? thrust: the shadow's mean is {mean:.3g} times that flown: mass, or largest thrust?")
    for one, other in (pair for group in EXCHANGED for pair in permutations(group, 2)):
        own, across = (correlation(axes[name][1], axes[one][2]) for name in (one, other))
        if abs(across) > ALIKE and not abs(own) > UNLIKE:
            out.append(f"frame? {one} of the shadow follows {other} of the flight (correlation {across:.2f})")
    return out
