"""A law with the prediction of ``quad_core.prediction`` before it, as a module of the same contract.

    state, actuation -> predict -> state now -> the law, which knows nothing of it

Whatever runs a law (node, replay, loop without ROS, compiled) runs this in its place, so that all give the same bits.
"""

from functools import cache
from types import FunctionType, ModuleType
from typing import Any, NamedTuple, cast

from quad_core.prediction import Known, Prediction, Shown, predict, unknown
from quad_core.records import field_kinds

_TEXT = '''\
def step(parameters, vehicle, memory, inputs, dt):
    """Return output, memory and internals of one step of ``dt`` s of the law on the predicted state."""
    state, known, shown = predict(
        parameters.prediction, vehicle, memory.known, inputs.state, inputs.actuation, dt
    )
    output, law, internals = law_step(parameters.law, vehicle, memory.law, Inputs({inputs}), dt)
    return output, Memory(law, known), Internals({internals})


def init(parameters, vehicle):
    """Return the memory before the first step."""
    return Memory(law_init(parameters.law, vehicle), unknown())
'''


@cache
def predicted(law: ModuleType, inputs: type[Any]) -> ModuleType:
    """Return the module of ``law`` on a predicted state; ``inputs`` is the class of what its stage takes.

    ``Parameters`` are (law, prediction), ``Memory`` (law, known), ``Internals`` the law's and those of ``Shown``.
    """
    module = ModuleType(f"{law.__name__}[predicted]", __doc__)
    found: dict[str, Any] = {
        "Parameters": _joined("Parameters", law, {"law": law.Parameters, "prediction": Prediction}),
        "Memory": _joined("Memory", law, {"law": law.Memory, "known": Known}),
        "Internals": _joined("Internals", law, {**field_kinds(law.Internals), **field_kinds(Shown)}),
        "COMPILES": getattr(law, "COMPILES", True),
        "PARTS": (predict, law.step),
    }
    scope: dict[str, Any] = {**found, "Inputs": inputs, "law_init": law.init, "unknown": unknown, "law": law.Internals}

    def assembled(predict: Any, law_step: Any) -> FunctionType:
        """Return ``step`` with these two functions, as they are or as machine code."""
        names = ", ".join("state" if name == "state" else f"inputs.{name}" for name in inputs._fields)
        shown = [f"internals.{name}" for name in law.Internals._fields] + [f"shown.{name}" for name in Shown._fields]
        own = {**scope, "predict": predict, "law_step": law_step, "__name__": __name__}
        # below the end of this file, so that no traceback shows a line of it that was not run
        exec(compile("\n" * 1000 + _TEXT.format(inputs=names, internals=", ".join(shown)), __file__, "exec"), own)
        for name in ("step", "init"):
            own[name].__qualname__ = f"{name}[{law.__name__}]"
        vars(module).setdefault("init", own["init"])
        return cast("FunctionType", own["step"])

    vars(module).update(found, assembled=assembled, step=assembled(predict, law.step))
    return module


def _joined(name: str, law: ModuleType, kinds: dict[str, type[Any]]) -> type[Any]:
    """Return a NamedTuple that pickles by reference: else Numba's file cache never knows it again."""
    made: type[Any] = NamedTuple(name, list(kinds.items()))  # type: ignore[misc]
    made.__module__ = __name__
    made.__qualname__ = f"{name}_{law.__name__.replace('.', '_')}"
    globals()[made.__qualname__] = made
    return made
