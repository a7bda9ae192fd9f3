"""What the stages of ``quad_core.cascade`` answer in one plant step: one function per row of the table, in a chain.

    answer(setup, memory, signals, internals, state, reference, actuation, k) -> signals, memory, internals, refused

A new row of ``STAGES`` needs no change here or in ``loop``. The functions are closures over what the table says, so
that CPython and Numba run the same text.
"""

from collections import namedtuple
from collections.abc import Callable, Sequence
from functools import cache
from types import ModuleType
from typing import Any

from quad_core.cascade import STAGES
from quad_core.cycle import seconds
from quad_core.records import finite_check
from quad_core.roles import Stage

PerStage: Any = namedtuple("PerStage", [stage.role for stage in STAGES])  # type: ignore[misc]
"""One value for each stage: its module, its parameters, its memory, its period in plant steps, ..."""

Signals: Any = namedtuple("Signals", [stage.output for stage in STAGES])  # type: ignore[misc]
"""The newest output of each stage; the last one is the command that the vehicle obeys."""

OUTSIDE = ("state", "reference")
"""What a stage may take in addition to outputs of earlier stages, of the same plant step."""
BEFORE = ("actuation",)  # what a stage may take in addition to outputs of any stage, of the plant step before

Function = Callable[..., Any]


def places(stages: Sequence[Stage], number: int) -> tuple[int, ...]:
    """Return where the inputs of stage ``number``, from 1, stand: the state, then what it takes.

    Counted in (state, reference, actuation, signals of the step before, outputs of the stages before it in this step).
    Raises ValueError for an input that the stage cannot have when it is due.
    """
    every = [stage.output for stage in stages]
    earlier = every[: number - 1]
    now = [*OUTSIDE, *[""] * (len(BEFORE) + len(every)), *earlier]
    before = [*[""] * len(OUTSIDE), *BEFORE, *every]
    found = [0]
    for topic, lag in stages[number - 1].inputs:
        offered = {0: now, 1: before}.get(lag, [])
        if topic not in offered:
            known = f"{', '.join((*OUTSIDE, *earlier))} or, with lag 1, {', '.join((*BEFORE, *every))}"
            raise ValueError(f"{stages[number - 1].role}: found {topic} with lag {lag}, expected {known}")
        found.append(offered.index(topic))
    return tuple(found)


@cache
def answer_of(modules: Any) -> Function:
    """Return ``answer`` of the stages whose modules are ``modules``, a ``PerStage``.

    It returns signals, memory and internals after plant step ``k``, and the number of the stage that was refused: from
    1, 0 for none. A stage is refused if a number in its output or its memory is not finite. ``actuation`` is that of
    the step before.
    """
    chain = _none
    for number, (stage, module) in enumerate(zip(STAGES, modules, strict=True), start=1):
        chain = _followed_by(chain, number, stage, module)

    def answer(
        setup: Any, memory: Any, signals: Any, internals: Any, state: Any, reference: Any, actuation: Any, k: int
    ) -> Any:
        given = (state, reference, actuation) + signals[:]  # noqa: RUF005 (Numba adds plain tuples)
        outputs, memories, shown, refused = chain(setup, memory, signals, internals, given, k)
        return Signals(*outputs), PerStage(*memories), PerStage(*shown), refused

    return answer


def _none(setup: Any, memory: Any, signals: Any, internals: Any, given: Any, k: int) -> Any:  # noqa: ARG001
    """Return what the stages before the first one answer."""
    return (), (), (), 0


def _followed_by(earlier: Function, number: int, stage: Stage, module: ModuleType) -> Function:
    """Return ``earlier`` and after it stage ``number`` with the ``step`` of ``module``."""
    at = number - 1
    step, inputs = module.step, stage.inputs_type
    taken = _taken(places(STAGES, number))
    is_finite, is_memory_finite = finite_check(stage.output_type), finite_check(module.Memory)

    def answer(setup: Any, memory: Any, signals: Any, internals: Any, given: Any, k: int) -> Any:
        outputs, memories, shown, refused = earlier(setup, memory, signals, internals, given, k)
        output, own, inside = signals[at], memory[at], internals[at]
        steps = setup.schedule.stage_steps[at]
        if refused == 0 and k % steps == 0:
            dt = seconds(steps, setup.schedule.plant_period)
            output, own, inside = step(setup.stages[at], setup.vehicle, own, inputs(*taken(given + outputs)), dt)
            if not (is_finite(output) and is_memory_finite(own)):
                refused = number
        return outputs + (output,), memories + (own,), shown + (inside,), refused  # noqa: RUF005

    return answer


def _taken(chosen: tuple[int, ...]) -> Function:
    """Return a function that takes the parts at ``chosen`` out of a tuple of several types."""
    last = chosen[-1]
    if len(chosen) == 1:
        return lambda given: (given[last],)
    first = _taken(chosen[:-1])
    return lambda given: first(given) + (given[last],)  # noqa: RUF005
