"""What the stages of ``quad_core.cascade`` answer in one plant step, as text made from the table.

    python -m quad_flight.stages    prints that text

A new row of ``STAGES`` needs no change here or in ``loop``.
"""

import sys
from collections import namedtuple
from collections.abc import Sequence
from functools import cache
from types import FunctionType
from typing import Any

from quad_core.cascade import STAGES, Stage
from quad_core.cycle import finite_check, seconds

PerStage: Any = namedtuple("PerStage", [stage.role for stage in STAGES])  # type: ignore[misc]
"""One value for each stage: its module, its parameters, its memory, its period in plant steps, ..."""

Signals: Any = namedtuple("Signals", [stage.gives for stage in STAGES])  # type: ignore[misc]
"""The newest output of each stage; the last one is the command that the vehicle obeys."""

OUTSIDE = ("state", "reference")
"""What a stage may take in addition to outputs of earlier stages, of the same plant step."""
BEFORE = ("actuation",)
"""What a stage may take in addition to outputs of any stage, of the plant step before."""

_HEAD = '''\
def answer(setup, memory, signals, internals, state, reference, actuation, k):
    """Return signals, memory and internals after plant step ``k``, and the number of the stage that was refused.

    Stages are numbered from 1; 0: none. A stage is refused if a number in its output or its memory is not finite.
    ``actuation`` is that of the step before.
    """
    steps = setup.schedule.stage_steps
    period = setup.schedule.plant_period
    refused = 0
'''


def text(stages: Sequence[Stage] = STAGES) -> str:
    """Return the text of ``answer``; raises ValueError for an input that a stage cannot have when it is due."""
    answers = [_answer(stage, number, _inputs(stages, number)) for number, stage in enumerate(stages, start=1)]
    roles = [stage.role for stage in stages]
    outputs = ", ".join(stage.gives for stage in stages)
    memories = ", ".join(f"{role}_memory" for role in roles)
    internals = ", ".join(f"{role}_internals" for role in roles)
    end = f"    return Signals({outputs}), PerStage({memories}), PerStage({internals}), refused\n"
    return "".join([_HEAD, *answers, end])


def _answer(stage: Stage, number: int, inputs: str) -> str:
    """Return the text of one stage."""
    role, gives = stage.role, stage.gives
    return f"""\
    # {role}: {stage.paper}
    {gives} = signals.{gives}
    {role}_memory = memory.{role}
    {role}_internals = internals.{role}
    if refused == 0 and k % steps.{role} == 0:
        {gives}, {role}_memory, {role}_internals = {role}_step(
            setup.stages.{role},
            setup.vehicle,
            memory.{role},
            {role}_inputs({inputs}),
            seconds(steps.{role}, period),
        )
        if not (is_finite_{gives}({gives}) and is_finite_{role}_memory({role}_memory)):
            refused = {number}
"""


def _inputs(stages: Sequence[Stage], number: int) -> str:
    """Return what the stage of this number gets: the state and what it takes."""
    earlier = [stage.gives for stage in stages[: number - 1]]
    every = [stage.gives for stage in stages]
    names = ["state"]
    for topic, lag in stages[number - 1].takes:
        if (lag == 0 and topic in (*OUTSIDE, *earlier)) or (lag == 1 and topic in BEFORE):
            names.append(topic)
        elif lag == 1 and topic in every:
            names.append(f"signals.{topic}")
        else:
            known = f"{', '.join((*OUTSIDE, *earlier))} or, with lag 1, {', '.join((*BEFORE, *every))}"
            raise ValueError(f"{stages[number - 1].role}: found {topic} with lag {lag}, expected {known}")
    return ", ".join(names)


@cache
def answer_of(modules: Any) -> FunctionType:
    """Return ``answer`` with the ``step`` of each of ``modules`` (a ``PerStage``) in its place."""
    scope: dict[str, Any] = {"PerStage": PerStage, "Signals": Signals, "seconds": seconds, "__name__": __name__}
    for stage, module in zip(STAGES, modules, strict=True):
        scope[f"{stage.role}_step"] = module.step
        scope[f"{stage.role}_inputs"] = stage.inputs
        scope[f"is_finite_{stage.gives}"] = finite_check(stage.output)
        scope[f"is_finite_{stage.role}_memory"] = finite_check(module.Memory)
    # below the end of this file, so that no traceback shows a line of it that was not run
    exec(compile("\n" * 1000 + text(), __file__, "exec"), scope)
    function = scope["answer"]
    assert isinstance(function, FunctionType)
    return function


if __name__ == "__main__":
    sys.stdout.write(text())
