"""What a controller saw at each of its steps, from the bag.

In lockstep the step decides: the state of step k, the setpoint that holds at k, the actuation of k - 1. In real time a
node takes what came last, which stamps alone do not tell: several setpoints and actuations are possible, and the
recorded answer says which it was, because the law gives that very answer, and those very internals, for it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from quad_core.bounds import is_flyable
from quad_core.node_parameters import LOCKSTEP, Plugin, Resolved
from quad_core.safe import hold_position, level_hover
from quad_core.timing import seconds
from quad_core.types import (
    Actuation,
    AttitudeInputs,
    AttitudeThrust,
    PositionInputs,
    TrajectoryPoint,
    Vec3,
    VehicleState,
    Wrench,
)
from quad_flight_log.cdr import Table
from quad_flight_log.metrics import thrust_and_torque
from quad_flight_log.tuples import Leaf, leaves, recorded_columns, tuples_of

_REACH = 40  # how many messages off the likely one may be: nodes stand still where the machine is busy
_SAFE_LAGS = 5
_TRIES = 400  # how many pairs of setpoint and actuation are tried for one answer


class Controller(NamedTuple):
    """One controller: which topic it takes beside state and actuation, which it answers with."""

    inputs: type[Any]
    setpoint_topic: str
    setpoint: type[Any]
    output_topic: str
    output: type[Any]


CONTROLLERS = {
    "position_controller": Controller(
        PositionInputs, "reference", TrajectoryPoint, "attitude_setpoint", AttitudeThrust
    ),
    "attitude_controller": Controller(AttitudeInputs, "attitude_setpoint", AttitudeThrust, "wrench_setpoint", Wrench),
}


class Moment(NamedTuple):
    """One step to be answered, the time since the last in s, and what the law may have seen, the likeliest first."""

    step: int
    dt: float
    candidates: Iterator[Any]


class Seen(NamedTuple):
    """The inputs of one step. ``known``: certain, or proved by the recorded answer."""

    step: int
    dt: float
    inputs: Any
    known: bool


def seen(
    role: str,
    then: Resolved,
    tables: Mapping[str, Table],
    where: str,
    extra: Sequence[str] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[Seen]:
    """Yield what the controller ``role``, told ``then``, saw at each of its steps.

    ``tables``: arrays sorted by stamp of all that it takes and gives; the internals may be missing. ``extra``: names of
    the law's own internals.
    """
    controller = CONTROLLERS[role]
    period = then.flight.plant_period
    states = tuples_of(VehicleState, tables["state"], f"{where}: state")
    steps = (tables["state"]["stamp_ns"] // period).tolist()
    given = _Given(controller, then, tables, where)
    if then.flight.mode == LOCKSTEP:
        found = _in_lockstep(then, steps, states, given)
    else:
        found = _proved(
            then, _Answers(controller, then, tables, extra), _in_real_time(then, tables, steps, states, given)
        )
    for index, moment in enumerate(found):
        yield moment
        if progress and index % 256 == 0:
            progress(min(moment.step, steps[-1]), steps[-1] + 1)
    if progress:
        progress(steps[-1] + 1, steps[-1] + 1)


class _Given:
    """Setpoints and actuations of a flight."""

    def __init__(self, controller: Controller, then: Resolved, tables: Mapping[str, Table], where: str) -> None:
        period, self.vehicle = then.flight.plant_period, then.vehicle
        table, topic = tables[controller.setpoint_topic], controller.setpoint_topic
        self.inputs = controller.inputs
        self.setpoints = tuples_of(controller.setpoint, table, f"{where}: {topic}")
        self.setpoint_steps = table["stamp_ns"] // period
        self.until = table["next_step"].tolist()
        rows = tuples_of(Actuation, tables["actuation"], f"{where}: actuation")
        self.actuations = dict(zip((tables["actuation"]["stamp_ns"] // period).tolist(), rows, strict=True))

    def newest(self, steps: list[int]) -> list[int]:
        """Return the index of the newest setpoint at or before each step, -1 before the first."""
        return [int(at) for at in np.searchsorted(self.setpoint_steps, steps, side="right") - 1]

    def near(self, state: VehicleState, step: int, newest: int) -> Iterator[Any]:
        """Yield what a law may have seen with the state of ``step``, the likeliest first: all that came just before."""
        setpoints = [at for at in _outward(newest) if 0 <= at < len(self.setpoints)]
        lags = [lag for lag in _outward(1) if step - lag in self.actuations]
        pairs = [(i + j, at, lag) for i, at in enumerate(setpoints) for j, lag in enumerate(lags)]
        for _, at, lag in sorted(pairs)[:_TRIES]:
            yield self.inputs(state, self.setpoints[at], self.actuations[step - lag])
        for at in setpoints:
            safe = self.instead(state, self.setpoints[at])
            yield from (self.inputs(state, safe, self.actuations[step - lag]) for lag in lags[:_SAFE_LAGS])
        if setpoints:
            yield self.inputs(state, self.setpoints[setpoints[0]], Actuation())

    def instead(self, state: VehicleState, setpoint: Any) -> Any:
        """Return what the node takes for a setpoint that is too old."""
        if self.inputs is AttitudeInputs:
            return level_hover(self.vehicle, state)
        return hold_position(setpoint)


def _outward(start: int) -> list[int]:
    """Return the integers around ``start``, nearest first."""
    return sorted(range(start - _REACH, start + _REACH + 1), key=lambda at: (abs(at - start), at))


def _in_lockstep(then: Resolved, steps: list[int], states: list[VehicleState], given: _Given) -> Iterator[Seen]:
    dt = seconds(then.node.period_steps, then.flight.plant_period)
    due = 0
    for step, state, at in zip(steps, states, given.newest(steps), strict=True):
        if step >= due and at >= 0 and step < given.until[at] and is_flyable(state):
            due = step + then.node.period_steps
            actuation = given.actuations.get(step - 1) or Actuation()
            yield Seen(step, dt, given.inputs(state, given.setpoints[at], actuation), True)


def _in_real_time(
    then: Resolved, tables: Mapping[str, Table], steps: list[int], states: list[VehicleState], given: _Given
) -> Iterator[Moment]:
    """Yield the steps that were answered; the node measures the time between them by their stamps, within bounds."""
    period = then.flight.plant_period
    nominal = then.node.period_steps * period
    at_step = dict(zip(steps, states, strict=True))
    answered = [step for step in _answered(then, tables) if step in at_step]
    before = -1
    for step, newest in zip(answered, given.newest(answered), strict=True):
        elapsed = nominal if before < 0 else min(max((step - before) * period, nominal // 2), 2 * nominal)
        before = step
        yield Moment(step, seconds(elapsed, 1), given.near(at_step[step], step, newest))


def _answered(then: Resolved, tables: Mapping[str, Table]) -> list[int]:
    topic = CONTROLLERS[then.role].output_topic
    return [int(step) for step in tables[topic]["stamp_ns"] // then.flight.plant_period]


class _Answers:
    """What was recorded of the answers of a law, to be held against what it gives."""

    def __init__(
        self, controller: Controller, then: Resolved, tables: Mapping[str, Table], extra: Sequence[str]
    ) -> None:
        period, kind = then.flight.plant_period, then.plugins["law"].module.Internals
        outputs = _outputs(controller, tables[controller.output_topic])
        self._outputs = dict(zip(_answered(then, tables), outputs, strict=True))
        self._inside: dict[int, list[float]] = {}
        self._leaves: list[Leaf] = []
        table = tables.get(f"{then.role}/internals")
        if table is not None:
            recorded = recorded_columns(kind, table, extra)
            self._leaves = [leaf for leaf in leaves(kind) if leaf.name in recorded]
            rows = np.stack([recorded[leaf.name] for leaf in self._leaves], axis=1).tolist()
            self._inside = dict(zip((table["stamp_ns"] // period).tolist(), rows, strict=True))
            self._places = [(kind._fields.index(leaf.field), leaf.place) for leaf in self._leaves]

    def fits(self, step: int, output: Any, internals: Any) -> bool:
        """Return whether the law gave at ``step`` what was recorded, output and internals."""
        if output != self._outputs[step]:
            return False
        inside = self._inside.get(step)
        return inside is None or inside == [
            float(internals[at] if place < 0 else internals[at][place]) for at, place in self._places
        ]


def _proved(then: Resolved, answers: _Answers, moments: Iterator[Moment]) -> Iterator[Seen]:
    law: Plugin = then.plugins["law"]
    memory = law.module.init(law.parameters, then.vehicle)
    proved = True
    for moment in moments:
        likeliest, after = None, memory
        for inputs in moment.candidates:
            output, then_memory, internals = law.module.step(law.parameters, then.vehicle, memory, inputs, moment.dt)
            matches = answers.fits(moment.step, output, internals)
            if likeliest is None or matches:
                likeliest, after = inputs, then_memory
            # Once an answer is not explained the law's memory is lost, and no later one can be.
            if matches or not proved:
                break
        else:
            proved = False
        if likeliest is not None:
            memory = after
            yield Seen(moment.step, moment.dt, likeliest, proved)


def _outputs(controller: Controller, table: Table) -> list[Any]:
    if controller.output is not Wrench:
        return tuples_of(controller.output, table, controller.output_topic)
    thrust, torque = thrust_and_torque(table)
    return [Wrench(up, Vec3(*turn)) for up, turn in zip(thrust.tolist(), torque.tolist(), strict=True)]
