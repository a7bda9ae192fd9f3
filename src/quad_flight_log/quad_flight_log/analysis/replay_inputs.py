"""What a controller saw at each of its steps, from the bag.

The internals say it: the time step, the step of each input, and which input was too old and replaced by a safe one. In
lockstep the steps decide as well, for bags without internals, or with some that do not say it: the state of step k,
each input as late as its row of ``quad_core.cascade`` says (the setpoint that holds at k, the actuation of k - 1).
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from quad_core.cascade import SIGNALS, STAGE
from quad_core.cycle import is_flyable, seconds
from quad_core.flight_parameters import LOCKSTEP
from quad_core.resolution import Resolved
from quad_core.roles import Stage
from quad_core.safe import safe_input
from quad_core.types import InputSteps, StepRecord, VehicleState
from quad_flight_log.analysis.tuples import tuples_of
from quad_flight_log.bag.messages import Table
from quad_flight_log.errors import TopicError


class Seen(NamedTuple):
    """The inputs of one step and its time step in s. ``complete``: all of them were recorded."""

    step: int
    dt: float
    inputs: Any
    complete: bool


def seen(
    then: Resolved, tables: Mapping[str, Table], where: str, progress: Callable[[int, int], None] | None = None
) -> Iterator[Seen]:
    """Yield what the controller with the parameters ``then`` saw at each of its steps.

    ``tables``: arrays sorted by stamp of all that it takes and gives; the internals may be missing.
    Raises TopicError for a flight in real time whose internals do not say what the law saw.
    """
    stage = STAGE[then.role]
    recorded = _step_records(stage, tables, where)
    if not recorded and then.flight.mode != LOCKSTEP:
        raise TopicError(f"{where}: {stage.internals_topic}: does not say which inputs the steps had (an older bag?)")
    given = _Given(stage, then, tables, where)
    last = max(given.states, default=0)
    found = given.as_recorded(recorded) if recorded else given.in_lockstep()
    for index, item in enumerate(found):
        yield item
        if progress and index % 256 == 0:
            progress(min(item.step, last), last + 1)
    if progress:
        progress(last + 1, last + 1)


def _step_records(stage: Stage, tables: Mapping[str, Table], where: str) -> dict[int, StepRecord]:
    """Return {step: how it came to its answer}, empty where the internals do not say it."""
    table = tables.get(stage.internals_topic)
    if table is None or "dt" not in (table.dtype.names or ()) or not table["dt"].any():
        return {}
    rows = tuples_of(StepRecord, table, f"{where}: {stage.internals_topic}")
    return dict(zip(table["step"].tolist(), rows, strict=True))


class _Given:
    """States and inputs of a flight by plant step."""

    def __init__(self, stage: Stage, then: Resolved, tables: Mapping[str, Table], where: str) -> None:
        self._stage, self._then = stage, then
        period = then.flight.plant_period

        def by_step(topic: str, kind: type[Any]) -> dict[int, Any]:
            steps = (tables[topic]["stamp_ns"] // period).tolist()
            return dict(zip(steps, tuples_of(kind, tables[topic], f"{where}: {topic}"), strict=True))

        self.states: dict[int, VehicleState] = by_step("state", VehicleState)
        self._inputs = [by_step(taken.topic, SIGNALS[taken.topic].kind) for taken in stage.takes]
        self._until = [
            dict(zip(known, tables[taken.topic]["next_step"].tolist(), strict=True))
            if "next_step" in (tables[taken.topic].dtype.names or ())
            else {}
            for taken, known in zip(stage.takes, self._inputs, strict=True)
        ]

    def as_recorded(self, records: Mapping[int, StepRecord]) -> Iterator[Seen]:
        """Yield the steps as their internals tell them."""
        for step, record in records.items():
            state = self.states.get(step)
            if state is None:
                continue
            values, complete = [], True
            for place, (taken, known) in enumerate(zip(self._stage.takes, self._inputs, strict=True)):
                at = record.input_steps[place]
                value = known.get(at) or SIGNALS[taken.topic].kind()
                complete &= at < 0 or at in known
                if record.replaced_inputs >> place & 1:
                    value = safe_input(taken.topic, value, self._then.vehicle, state)
                values.append(value)
            yield Seen(step, record.dt, self._stage.inputs(state, *values), complete)

    def in_lockstep(self) -> Iterator[Seen]:
        """Yield the steps that the node answers in lockstep."""
        period_steps = self._then.node.period_steps
        dt = seconds(period_steps, self._then.flight.plant_period)
        ordered = [np.array(sorted(known), dtype=np.int64) for known in self._inputs]
        due = 0
        for step, state in self.states.items():
            if step < due or not is_flyable(state):
                continue
            steps = [self._holding(place, step, ordered[place]) for place in range(len(ordered))]
            if any(at < 0 and not taken.lag for at, taken in zip(steps, self._stage.takes, strict=True)):
                continue
            due = step + period_steps
            yield from self.as_recorded({step: StepRecord(dt, InputSteps(*steps))})

    def _holding(self, place: int, step: int, ordered: Any) -> int:
        """Return the step of the value of an input that holds at ``step``, or -1."""
        lag = self._stage.takes[place].lag
        if lag:
            return step - lag if step - lag in self._inputs[place] else -1
        at = int(np.searchsorted(ordered, step, side="right")) - 1
        newest = int(ordered[at]) if at >= 0 else -1
        return newest if step < self._until[place].get(newest, step + 1) else -1
