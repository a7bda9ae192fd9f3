"""Recorded inputs fed to a control law again, its outputs held against what was recorded.

The law runs as its node runs it (same inputs per step, same memory from the first step on), so with the recorded
parameters every bit is the same: that is the log's own proof. With other gains or another law the
answers to the very same inputs differ, and the difference is reported; the vehicle does not follow the new answers.
Of a controller that was started again in flight and flew later, the memory runs from the step on at which it began.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.cascade import STAGE
from quad_core.flight_parameters import LOCKSTEP
from quad_core.resolution import Resolved
from quad_flight_log.analysis.arrays import by_stamp
from quad_flight_log.analysis.recorded_parameters import Change, recorded_parameters, retold
from quad_flight_log.analysis.replay_inputs import seen
from quad_flight_log.analysis.takeovers import Flier, fliers
from quad_flight_log.analysis.tuples import Columns, columns_of, recorded_columns
from quad_flight_log.bag.messages import Table
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import TopicError


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
    phases, changed = retold(flight, role, law=law, settings=settings)
    start = phases[0].resolved
    stage = STAGE[role]
    internals_topic = stage.internals_topic
    tables = {
        topic: by_stamp(table)
        for topic, table in flight.arrays(
            "state",
            *(taken.topic for taken in stage.takes),
            stage.gives,
            *((internals_topic,) if flight.has(internals_topic) else ()),
        ).items()
    }
    empty = [topic for topic, table in tables.items() if len(table) == 0]
    if empty:
        raise TopicError(f"{flight.path}: no message on {', '.join(empty)}: there is nothing to replay {role} with")
    record = recorded_parameters(flight)[role]
    then = start if not changed else retold(flight, role)[0][0].resolved
    waiting, flown = phases[1:], fliers(flight, role)
    parameters = start.law.parameters
    memories = _Memories(start, flown)
    steps, outputs, internals, incomplete = [], [], [], 0
    for step, dt, inputs, complete in seen(then, tables, str(flight.path), progress):
        while waiting and waiting[0].step <= step:
            parameters = waiting.pop(0).resolved.law.parameters
        output, inside = memories.answer(step, parameters, inputs, dt)
        steps.append(step)
        outputs.append(output)
        internals.append(inside)
        incomplete += not complete
    recorded = {stage.gives: recorded_columns(stage.output, tables[stage.gives])}
    replayed = {stage.gives: columns_of(stage.output, outputs)}
    if internals_topic in tables and not _other_law(record.values, start):
        kind = start.law.module.Internals
        recorded[internals_topic] = recorded_columns(kind, tables[internals_topic], record.internals_names)
        replayed[internals_topic] = columns_of(kind, internals)
    stamps = np.array(steps, dtype=np.int64) * start.flight.plant_period
    notes = _notes(incomplete, record.changes) + _exchange_notes(start, flown[1:])
    for step, (output, inside) in memories.in_place.items():
        given = {stage.gives: columns_of(stage.output, [output])}
        given[internals_topic] = columns_of(start.law.module.Internals, [inside])
        notes += _sent_by_the_next(step, step * start.flight.plant_period, given, tables, stamps, recorded, replayed)
    return _compared(role, start, changed, tables, stamps, recorded, replayed, notes)


class _Memories:
    """The memories of all controllers that flew a stage: each runs from its beginning to the last step of its node."""

    def __init__(self, start: Resolved, flown: Sequence[Flier]) -> None:
        self._module, self._vehicle = start.law.module, start.vehicle
        self._flown = flown
        ends = [one.step for one in flown[1:]] + [sys.maxsize]
        # a controller that ran from the start has the same memory as the other
        self._until = {one.memory_step: end for one, end in zip(flown, ends, strict=True)}
        self._known: dict[int, Any] = {}
        self._last: tuple[int, Flier, dict[int, tuple[Any, Any]]] = (-1, flown[0], {})
        self.in_place: dict[int, tuple[Any, Any]] = {}
        """What the next controller had computed for the last step before, and may have sent for the killed one."""

    def answer(self, step: int, parameters: Any, inputs: Any, dt: float) -> tuple[Any, Any]:
        """Return output and internals of the controller that flew at ``step``; the others compute along."""
        flier = next(one for one in reversed(self._flown) if one.step <= step or one is self._flown[0])
        given: dict[int, tuple[Any, Any]] = {}
        for began, until in self._until.items():
            if began <= step < until or began == flier.memory_step:
                if began not in self._known or inputs.state.on_ground:
                    self._known[began] = self._module.init(parameters, self._vehicle)
                known = self._known[began]
                output, self._known[began], inside = self._module.step(parameters, self._vehicle, known, inputs, dt)
                given[began] = output, inside
        before, last, others = self._last
        if flier.memory_step != last.memory_step and flier.memory_step in others:
            self.in_place[before] = others[flier.memory_step]
        self._last = step, flier, given
        return given[flier.memory_step]


def _sent_by_the_next(
    step: int,
    stamp: int,
    given: Mapping[str, Columns],
    tables: Mapping[str, Table],
    stamps: NDArray[np.int64],
    recorded: Mapping[str, Columns],
    replayed: Mapping[str, Columns],
) -> list[str]:
    """Put what the next controller has computed for a step where that was recorded; returns a note for each topic."""
    row, notes = int(np.flatnonzero(stamps == stamp)[0]), []
    for topic, columns in recorded.items():
        there = tables[topic]["stamp_ns"] == stamp
        if _takes_the_place(
            {name: values[there] for name, values in columns.items()}, replayed[topic], row, given[topic]
        ):
            notes.append(f"{topic} of step {step} was sent by the next controller")
    return notes


def _takes_the_place(recorded: Columns, replayed: Columns, row: int, instead: Columns) -> bool:
    """Put ``instead`` into a ``row`` that was replayed otherwise if it is what was recorded; returns whether it is."""
    if not all(_bits(values) == _bits(instead[name]) for name, values in recorded.items()):
        return False
    differs = any(_bits(replayed[name][row : row + 1]) != _bits(instead[name]) for name in recorded)
    for name in recorded:
        replayed[name][row] = instead[name][0]
    return differs


def _bits(values: NDArray[np.float64]) -> bytes:
    return values.tobytes()


def _compared(
    role: str,
    resolved: Resolved,
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
    law, steps = resolved.plugins["law"].name, common // resolved.flight.plant_period
    return Replay(role, law, changed, steps, old, new, missing, notes)


def _other_law(values: Mapping[str, Any], resolved: Resolved) -> bool:
    return bool(values.get("law") != resolved.plugins["law"].name)


def _exchange_notes(start: Resolved, taken_over: Sequence[Flier]) -> list[str]:
    notes = [f"{one.node} flew from step {one.step} on, its memory began at {one.memory_step}" for one in taken_over]
    if notes and start.flight.mode != LOCKSTEP:
        notes.append("in real time the bag does not say what the standby received: its memory is rebuilt only nearly")
    return notes


def _notes(incomplete: int, changes: tuple[Change, ...]) -> list[str]:
    notes = []
    if incomplete:
        notes.append(f"at {incomplete} steps an input that the law had was not recorded")
    known = [f"{change.step}" for change in changes if change.step >= 0]
    if known:
        notes.append(f"parameters were changed in flight; the replay changes them at step {', '.join(known)}, too")
    unknown = [f"{change.time:.2f} s" for change in changes if change.step < 0]
    if unknown:
        times = ", ".join(unknown)
        notes.append(f"parameters were changed in flight at {times}, from an unknown step on; the replay does not")
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
