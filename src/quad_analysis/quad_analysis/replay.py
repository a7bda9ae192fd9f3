"""Recorded inputs fed to a control law again, its outputs compared with the recorded ones.

The internals of each step say what the law had: its time step, the step of each input, and which input was too old
and replaced by a safe one. The law runs as its node runs it, with one memory from the first step on, so with the
recorded parameters every bit is the same: that is the log's own proof.
"""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_analysis.arrays import by_stamp
from quad_analysis.metrics import thrust_and_torque
from quad_analysis.tables import flown_phases, recorded_parameters
from quad_core.cascade import SIGNALS, STAGE
from quad_core.records import builder, dtype_of, field_kinds, flattener, leaves
from quad_core.resolution import Resolved
from quad_core.roles import Stage
from quad_core.types import StepRecord, Vec3, VehicleState, Wrench
from quad_core.vehicle import safe_input
from quad_flight_log.errors import FlightLogError, SchemaError, TopicError
from quad_flight_log.messages import Table
from quad_flight_log.reader import Flight

Columns = dict[str, NDArray[Any]]


class Difference(NamedTuple):
    """One number of an output: at how many steps it differs, from which on (-1: none), and by how much at most."""

    name: str
    differing: int
    first_step: int
    largest: float


Seen = tuple[int, float, Any, bool]
"""What a controller has at a step: the step, its time step in s, its inputs, whether all of them were recorded."""


class Answers(NamedTuple):
    """What a law answered, an entry per step; ``incomplete``: steps that had an input which was not recorded."""

    steps: list[int]
    outputs: list[Any]
    internals: list[Any]
    incomplete: int


class Replay(NamedTuple):
    """One controller, replayed.

    ``steps``: plant steps compared, shape (n,). ``recorded`` and ``replayed``: {``topic field.part``: values (n,)} of
    output and internals. ``missing``: recorded steps that the replay did not answer or the other way round.
    ``notes``: what limits the comparison.
    """

    role: str
    law: str
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
        found = []
        for name, recorded in self.recorded.items():
            replayed = self.replayed[name]
            where = np.flatnonzero(recorded.view(np.int64) != replayed.view(np.int64))
            first = int(self.steps[where[0]]) if len(where) else -1
            gap = np.abs(replayed[where] - recorded[where]).max(initial=0.0)
            found.append(Difference(name, len(where), first, float(gap)))
        return found


def answered(phases: Sequence[tuple[int, Resolved]], seen: Iterable[Seen], anew: Container[int] = ()) -> Answers:
    """Return what a law says to what was ``seen``: one memory all along, begun again at the steps ``anew``.

    ``phases``: as ``flown_phases`` gives them.
    """
    (_, start), *waiting = phases
    module, parameters, memory = start.law.module, start.law.parameters, None
    steps, outputs, internals, incomplete = [], [], [], 0
    for step, dt, inputs, complete in seen:
        while waiting and waiting[0][0] <= step:
            parameters = waiting.pop(0)[1].law.parameters
        if memory is None or inputs.state.on_ground or step in anew:
            memory = module.init(parameters, start.vehicle)
        output, memory, inside = module.step(parameters, start.vehicle, memory, inputs, dt)
        steps.append(step)
        outputs.append(output)
        internals.append(inside)
        incomplete += not complete
    return Answers(steps, outputs, internals, incomplete)


def replay(flight: Flight, role: str, law: str | None = None) -> Replay:
    """Feed the recorded inputs of ``role`` to its law, or to ``law`` with its defaults, as a shadow would answer them.

    Raises TopicError if an input, the output or the internals were not recorded, FlightLogError for
    impossible parameters.
    """
    record = recorded_parameters(flight).get(role)
    if record is None:
        raise FlightLogError(f"{flight.path}: flight/parameters says nothing of {role}")
    phases = flown_phases(record, role, law)
    start, stage = phases[0][1], STAGE[role]
    steps, outputs, internals, incomplete = answered(phases, seen_on_board(start, stage, flight, {}))
    tables = {topic: by_stamp(flight.array(topic)) for topic in (stage.output, stage.internals_topic)}
    period, notes, module = start.flight.plant_period, [], start.law.module
    results: dict[str, tuple[Any, Sequence[str], list[Any]]] = {stage.output: (stage.output_type, (), outputs)}
    if record.values.get("law") == start.plugins["law"].name:
        results[stage.internals_topic] = module.Internals, record.internals_names, internals
    if incomplete:
        notes.append(f"at {incomplete} steps an input that the law had was not recorded")
    if record.changes:
        changes = ", ".join(str(change.step) for change in record.changes)
        notes.append(f"parameters were changed in flight; the replay changes them at step {changes}, too")
    stamps = np.array(steps, dtype=np.int64) * period
    common, missing, old, new = stamps, 0, {}, {}
    for topic in results:
        common = np.intersect1d(common, tables[topic]["stamp_ns"], assume_unique=True)
        missing = max(missing, len(np.setxor1d(stamps, tables[topic]["stamp_ns"])))
    here = np.isin(stamps, common)
    for topic, (kind, names, given) in results.items():
        table = tables[topic][np.isin(tables[topic]["stamp_ns"], common)]
        recorded = columns_of(kind, tuples_of(kind, table, f"{flight.path}: {topic}", names))
        old.update({f"{topic} {name}": column for name, column in recorded.items()})
        new.update({f"{topic} {name}": column[here] for name, column in columns_of(kind, given).items()})
    return Replay(role, start.plugins["law"].name, common // period, old, new, missing, notes)


@lru_cache(16)
def by_step(flight: Flight, topic: str, period: int) -> dict[int, Any]:
    """Return {plant step of ``period`` ns: message of ``topic``, of internals the StepRecord}; kept for the next."""
    kind = StepRecord if topic.endswith("/internals") else SIGNALS[topic].kind
    table = by_stamp(flight.array(topic))
    rows = tuples_of(kind, table, f"{flight.path}: {topic}")
    return dict(zip((table["stamp_ns"] // period).tolist(), rows, strict=True))


def seen_on_board(
    flown: Resolved, stage: Stage, flight: Flight, others: Mapping[str, Mapping[int, Any]]
) -> Iterator[Seen]:
    """Yield what a controller with the parameters ``flown`` had at each step of its internals.

    ``others``: {topic: {step: value}} that it had instead of the recorded ones.
    """
    period, topic = flown.flight.plant_period, stage.internals_topic
    shown = flight.array(topic)
    kinds = {name: shown.dtype[name].base.kind for name in shown.dtype.names or ()}
    if [kinds.get(name) for name in StepRecord._fields] not in (["f", "i", "u"], ["f", "i", "i"]) or not shown[
        "dt"
    ].any():
        raise TopicError(f"{flight.path}: {topic}: does not say which inputs the steps had (an older bag?)")
    states: dict[int, VehicleState] = by_step(flight, "state", period)
    given = [others.get(taken.topic) or by_step(flight, taken.topic, period) for taken in stage.inputs]
    for step, record in by_step(flight, topic, period).items():
        state = states.get(step)
        if state is None:
            continue
        values, complete = [], True
        for place, (taken, known) in enumerate(zip(stage.inputs, given, strict=True)):
            at = record.input_steps[place]
            value = known.get(at) or SIGNALS[taken.topic].kind()
            complete &= at < 0 or at in known
            if record.replaced_inputs >> place & 1:
                value = safe_input(taken.topic, value, flown.vehicle, state)
            values.append(value)
        yield step, record.dt, stage.inputs_type(state, *values), complete


def tuples_of(kind: type[Any], table: Table, where: str, extra: Sequence[str] = ()) -> list[Any]:
    """Return each row of ``table`` as a ``kind``; raises SchemaError if the table lacks a field of it.

    ``extra``: names of the numbers in the field ``extra``, in order, for what the message has no field of its own.
    """
    if kind is Wrench:
        thrust, torque = thrust_and_torque(table)
        return [Wrench(up, Vec3(*turn)) for up, turn in zip(thrust.tolist(), torque.tolist(), strict=True)]
    numbers: list[list[Any]] = []
    names, own = table.dtype.names or (), dtype_of(kind)
    for name, inner in field_kinds(kind).items():
        parts = [leaf.name for leaf in leaves(inner, name)]
        if name in names and table.dtype[name].shape == own[name].shape:
            numbers += table[name].reshape(len(table), -1).T.tolist()
        elif "extra" in names and set(parts) <= set(extra) and all(len(row) == len(extra) for row in table["extra"]):
            numbers += [[float(row[extra.index(part)]) for row in table["extra"]] for part in parts]
        else:
            raise SchemaError(f"{where}: has no field {name!r} of {len(parts)} numbers")
    return list(map(builder(kind), zip(*numbers, strict=True)))


def columns_of(kind: type[Any], items: Sequence[Any]) -> Columns:
    """Return {leaf name: values, shape (n,)} of NamedTuples."""
    names = [leaf.name for leaf in leaves(kind)]
    # one flat row per item by a getter in C: three times as fast as NumPy on nested tuples
    rows = np.array(list(map(flattener(kind), items)), dtype=np.float64).reshape(len(items), len(names))
    return dict(zip(names, rows.T, strict=True))
