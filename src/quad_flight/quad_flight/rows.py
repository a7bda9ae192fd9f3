"""What a flight logs: one row of numbers per plant step, split into the step topics afterwards.

Handing lists of NamedTuples from compiled code back to CPython costs a hundred times the flight itself.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quad_core.cascade import SIGNALS, SIMULATOR, STAGES, TRAJECTORY
from quad_core.records import dtype_of, leaves
from quad_flight.loop import Row, Schedule

Write = Callable[[NDArray[np.float64], int, Row], None]
Block = tuple[int, NDArray[np.float64]]  # first plant step and rows of a part of a flight


@cache
def logged(stages: Any) -> list[tuple[str, str, type[Any], int]]:
    """Return topic, where in a ``Row`` it stands, what it carries and whose it is, of the step topics of a flight.

    ``stages``: a ``PerStage`` of modules. The last is the number of a stage, from 1; 0: vehicle or reference.
    """
    found = [(signal.topic, signal.topic, signal.kind, 0) for signal in SIGNALS.values() if signal.topic in Row._fields]
    for number, (stage, module) in enumerate(zip(STAGES, stages, strict=True), start=1):
        found.append((stage.output, f"signals.{stage.output}", stage.output_type, number))
        found.append((stage.internals_topic, f"internals.{stage.role}", module.Internals, number))
    return found


@cache
def names(stages: Any) -> tuple[str, ...]:
    """Return the dotted name in a ``Row`` of every number of a row, in order."""
    return tuple(leaf.name for _, path, kind, _ in logged(stages) for leaf in leaves(kind, path))


@cache
def writer(stages: Any) -> Write:
    """Return the function that writes a ``Row`` into one row of an array, assignments that Numba compiles too."""
    lines = [f"    rows[i, {column}] = row.{name}" for column, name in enumerate(names(stages))]
    scope: dict[str, Any] = {"__name__": __name__}
    exec(compile("\n".join(["def write(rows, i, row):", *lines]), __file__, "exec"), scope)
    write: Write = scope["write"]
    return write


def split(stages: Any, schedule: Schedule, blocks: Sequence[Block], refused: int) -> dict[str, NDArray[Any]]:
    """Return {topic: its messages, with step, next_step and stamp_ns} of a flight.

    Of the last step, where stage number ``refused`` was refused (0: none), only what went before was published.
    """
    periods = {SIMULATOR: 1, TRAJECTORY: schedule.trajectory_steps, **schedule.stage_steps._asdict()}
    topics = {}
    column = 0
    for topic, _, kind, stage in logged(stages):
        period = periods[SIGNALS[topic].publisher]
        end = column + len(leaves(kind))
        # a block may begin between two messages
        parts = [rows[-first % period :: period, column:end] for first, rows in blocks]
        values = np.concatenate(parts)
        first, rows = blocks[-1]
        if refused and (topic == "actuation" or stage >= refused) and (first + len(rows) - 1) % period == 0:
            values = values[:-1]
        topics[topic] = with_steps(kind, values, period, schedule.plant_period)
        column = end
    return topics


def with_steps(kind: type[Any], rows: NDArray[np.float64], period_steps: int, plant_period: int) -> NDArray[Any]:
    """Return rows of the numbers of a ``kind`` as messages of a publisher from step 0 on.

    Their fields: ``step``, ``next_step``, ``stamp_ns``, and those of ``kind``, of which a Vec3 has shape (3,).
    """
    own = dtype_of(kind)
    head = [(name, np.int64) for name in ("step", "next_step", "stamp_ns")]
    full = np.empty(len(rows), dtype=np.dtype([*head, *own.descr]))
    full["step"] = np.arange(len(rows)) * period_steps
    full["next_step"] = full["step"] + period_steps
    full["stamp_ns"] = full["step"] * plant_period
    start = 0
    for name in own.names or ():
        shape = own[name].shape
        end = start + sum(shape or (1,))
        full[name] = rows[:, start:end].reshape(len(rows), *shape)
        start = end
    return full
