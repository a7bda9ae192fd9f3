"""Recorded inputs fed to a control law again, its outputs held against what was recorded.

The law runs as its node runs it (same inputs per step, same memory from the first step on), so with the recorded
parameters every bit is the same: that is the log's own proof. With other gains or another law the
answers to the very same inputs differ, and the difference is told; the vehicle does not follow the new answers.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.node_parameters import Resolved
from quad_core.types import Wrench
from quad_flight_log.arrays import by_stamp
from quad_flight_log.cdr import Table
from quad_flight_log.errors import TopicError
from quad_flight_log.metrics import thrust_and_torque
from quad_flight_log.reader import Flight
from quad_flight_log.recorded_parameters import recorded_parameters, retold
from quad_flight_log.replay_inputs import CONTROLLERS, seen
from quad_flight_log.tuples import Columns, columns_of, recorded_columns


class Difference(NamedTuple):
    """One number of an output: how far replayed and recorded values are apart; ``first_step`` -1 if nowhere."""

    name: str
    differing: int
    first_step: int
    largest: float
    rms: float
    recorded_rms: float


class Replay(NamedTuple):
    """One controller, replayed.

    ``steps``: plant steps compared, shape (n,). ``recorded`` and ``replayed``: {``topic field.part``: values (n,)} of
    output and internals. ``missing``: recorded steps that the replay did not answer or the other way round.
    ``changed``: parameters or law differ from the recorded ones. ``notes``: what limits the comparison.
    """

    role: str
    law: str
    changed: bool
    steps: NDArray[np.int64]
    recorded: Columns
    replayed: Columns
    missing: int
    notes: list[str]

    @property
    def equal(self) -> bool:
        """Whether every recorded answer was given again, bit for bit."""
        return len(self.steps) > 0 and not self.missing and not any(item.differing for item in self.differences())

    def differences(self) -> list[Difference]:
        """Return one entry per number, in the order of the messages."""
        return [_difference(name, self.steps, self.recorded[name], self.replayed[name]) for name in self.recorded]


def replay(
    flight: Flight,
    role: str,
    *,
    law: str | None = None,
    settings: Mapping[str, str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Replay:
    """Feed the recorded inputs of ``role`` to its law (or ``law``) with ``settings`` ({parameter: text}) changed.

    Raises TopicError if an input or the output was not recorded, RecordedParametersError for impossible parameters.
    """
    told, changed = retold(flight, role, law=law, settings=settings)
    controller = CONTROLLERS[role]
    internals_topic = f"{role}/internals"
    tables = {
        topic: by_stamp(table)
        for topic, table in flight.arrays(
            "state",
            "actuation",
            controller.setpoint_topic,
            controller.output_topic,
            *((internals_topic,) if flight.has(internals_topic) else ()),
        ).items()
    }
    empty = [topic for topic, table in tables.items() if len(table) == 0]
    if empty:
        raise TopicError(f"{flight.path}: no message on {', '.join(empty)}: there is nothing to replay {role} with")
    record = recorded_parameters(flight)[role]
    then = told if not changed else retold(flight, role)[0]
    plugin = told.plugins["law"]
    memory = plugin.module.init(plugin.parameters, told.vehicle)
    steps, outputs, internals, unknown = [], [], [], 0
    for step, dt, inputs, known in seen(role, then, tables, str(flight.path), record.internals_names, progress):
        output, memory, inside = plugin.module.step(plugin.parameters, told.vehicle, memory, inputs, dt)
        steps.append(step)
        outputs.append(output)
        internals.append(inside)
        unknown += not known
    recorded = {controller.output_topic: _output_columns(controller.output, tables[controller.output_topic])}
    replayed = {controller.output_topic: columns_of(controller.output, outputs)}
    if internals_topic in tables and not _other_law(record.values, told):
        kind = told.plugins["law"].module.Internals
        recorded[internals_topic] = recorded_columns(kind, tables[internals_topic], record.internals_names)
        replayed[internals_topic] = columns_of(kind, internals)
    stamps = np.array(steps, dtype=np.int64) * told.flight.plant_period
    return _compared(role, told, changed, tables, stamps, recorded, replayed, _notes(unknown, record.changed))


def _compared(
    role: str,
    told: Resolved,
    changed: bool,
    tables: Mapping[str, Table],
    stamps: NDArray[np.int64],
    recorded: Mapping[str, Columns],
    replayed: Mapping[str, Columns],
    notes: list[str],
) -> Replay:
    old, new = {}, {}
    common = stamps
    for topic in recorded:
        common = np.intersect1d(common, tables[topic]["stamp_ns"], assume_unique=True)
    for topic, columns in recorded.items():
        there = np.isin(tables[topic]["stamp_ns"], common)
        here = np.isin(stamps, common)
        for name, values in columns.items():
            old[f"{topic} {name}"] = values[there]
            new[f"{topic} {name}"] = replayed[topic][name][here]
    missing = max((len(np.setxor1d(stamps, tables[topic]["stamp_ns"])) for topic in recorded), default=0)
    return Replay(role, told.plugins["law"].name, changed, common // told.flight.plant_period, old, new, missing, notes)


def _output_columns(kind: type[Any], table: Table) -> Columns:
    if kind is not Wrench:
        return recorded_columns(kind, table)
    thrust, torque = thrust_and_torque(table)
    return {"thrust": thrust, **{f"torque_b.{axis}": torque[:, at] for at, axis in enumerate("xyz")}}


def _other_law(values: Mapping[str, Any], told: Resolved) -> bool:
    return bool(values.get("law") != told.plugins["law"].name)


def _notes(unknown: int, changed_at: tuple[float, ...]) -> list[str]:
    notes = []
    if unknown:
        notes.append(f"flown in real time: at {unknown} steps no recorded input explains the answer")
    if changed_at:
        times = ", ".join(f"{time:.2f} s" for time in changed_at)
        notes.append(f"parameters were changed in flight at {times}; the replay keeps those of the start")
    return notes


def _difference(
    name: str, steps: NDArray[np.int64], recorded: NDArray[np.float64], replayed: NDArray[np.float64]
) -> Difference:
    differs = recorded.view(np.int64) != replayed.view(np.int64)
    where = np.flatnonzero(differs)
    gap = np.abs(np.where(differs, replayed - recorded, 0.0))
    return Difference(
        name,
        len(where),
        int(steps[where[0]]) if len(where) else -1,
        float(gap.max(initial=0.0)),
        float(np.sqrt(np.mean(gap * gap))) if len(gap) else 0.0,
        float(np.sqrt(np.mean(recorded * recorded))) if len(gap) else 0.0,
    )
