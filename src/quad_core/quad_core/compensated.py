"""A law with prediction before it and rotor lead after it, as a module of the same contract.

    state, actuation -> quad_core.prediction -> state now -> the law -> wrench -> quad_core.rotor_lead -> wrench sent

Each of the two only where it is asked for; the law knows nothing of them. Whatever runs a law (node, replay, loop
without ROS, compiled) runs this in its place, so that all give the same bits.
"""

from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Any

from quad_core.prediction import Estimate, Prediction, Shown, predict, unknown
from quad_core.records import field_kinds, referable
from quad_core.rotor_lead import Given, LeadShown, RotorLead, ahead_of_rotors

COMPENSATIONS = ("prediction", "rotor_lead")
"""Parameter groups of a controller that may stand around its law, each with its own ``enabled``."""

Function = Callable[..., Any]


@cache
def compensated(law: ModuleType, inputs: type[Any], names: frozenset[str], predicted: Function = predict) -> ModuleType:
    """Return the module of ``law`` with those COMPENSATIONS that ``names`` has around it.

    ``inputs`` is the class of what the law's stage takes, the state first. ``Parameters`` are (law, one per name),
    ``Memory`` is (law, one per name), ``Internals`` are the law's and what each shows. ``predicted`` predicts.
    """
    first: dict[str, Any] = {"law": law.Memory}
    parameters: dict[str, Any] = {"law": law.Parameters}
    internals = field_kinds(law.Internals)
    before, after = _as_it_is, _as_asked
    if "prediction" in names:
        before = _predicting(predicted)
        parameters["prediction"], first["known"] = Prediction, Estimate
        internals |= field_kinds(Shown)
    if "rotor_lead" in names:
        after = _leading
        parameters["rotor_lead"], first["given"] = RotorLead, Given
        internals |= field_kinds(LeadShown)
    title = "_".join(name for name in COMPENSATIONS if name in names)
    suffix = f"{law.__name__}_{title}"
    module = ModuleType(f"{law.__name__}[{title}]", __doc__)
    memory_kind, shown_kind = (
        referable("Memory", suffix, first, __name__),
        referable("Internals", suffix, internals, __name__),
    )
    vars(module).update(
        Parameters=referable("Parameters", suffix, parameters, __name__),
        Memory=memory_kind,
        Internals=shown_kind,
        COMPILES=getattr(law, "COMPILES", True),
        init=_init(law.init, memory_kind, [kind for name, kind in first.items() if name != "law"]),
        step=_step(law.step, inputs, memory_kind, shown_kind, before, after),
    )
    return module


def _step(
    law: Function, inputs_kind: Any, memory_kind: Any, shown_kind: Any, before: Function, after: Function
) -> Function:
    """Return ``step`` of the law with what stands before and after it."""

    def step(parameters: Any, vehicle: Any, memory: Any, inputs: Any, dt: float) -> Any:
        state, known, shown = before(parameters, vehicle, memory, inputs, dt)
        output, own, internals = law(parameters.law, vehicle, memory.law, inputs_kind(state, *inputs[1:]), dt)
        output, given, led = after(parameters, vehicle, memory, output, dt)
        return output, memory_kind(own, *(known + given)), shown_kind(*(internals[:] + shown[:] + led[:]))

    return step


def _as_it_is(parameters: Any, vehicle: Any, memory: Any, inputs: Any, dt: float) -> Any:  # noqa: ARG001
    return inputs.state, (), ()


def _predicting(predicted: Function) -> Function:
    def before(parameters: Any, vehicle: Any, memory: Any, inputs: Any, dt: float) -> Any:
        state, known, shown = predicted(
            parameters.prediction, vehicle, memory.known, inputs.state, inputs.actuation, dt
        )
        return state, (known,), shown

    return before


def _as_asked(parameters: Any, vehicle: Any, memory: Any, output: Any, dt: float) -> Any:  # noqa: ARG001
    return output, (), ()


def _leading(parameters: Any, vehicle: Any, memory: Any, output: Any, dt: float) -> Any:
    output, given, led = ahead_of_rotors(parameters.rotor_lead, vehicle, memory.given, output, dt)
    return output, (given,), led


def _init(law: Function, memory_kind: Any, others: list[Any]) -> Function:
    """Return ``init``: the memory before the first step."""

    def init(parameters: Any, vehicle: Any) -> Any:
        return memory_kind(
            law(parameters.law, vehicle), *(unknown() if kind is Estimate else kind() for kind in others)
        )

    return init
