"""A law with prediction before it and rotor lead after it, as a module of the same contract.

    state, actuation -> quad_core.prediction -> state now -> the law -> wrench -> quad_core.rotor_lead -> wrench sent

Each of the two only where it is asked for; the law knows nothing of them. Whatever runs a law (node, replay, loop
without ROS, compiled) runs this in its place, so that all give the same bits.
"""

from collections.abc import Callable
from functools import cache
from types import FunctionType, ModuleType
from typing import Any, NamedTuple, cast

from quad_core.prediction import Known, Prediction, Shown, predict, unknown
from quad_core.records import field_kinds
from quad_core.rotor_lead import Given, LeadShown, RotorLead, ahead_of_rotors


class _Part(NamedTuple):
    """Something before or after a law: its function with its text in ``step``, its types, its first memory.

    ``name`` is that of its parameters in the node and here; ``memory``, ``first`` and ``shown`` are names in the text.
    """

    name: str
    function: Callable[..., Any]
    text: str
    after: bool
    parameters: type[Any]
    memory: str
    memory_kind: type[Any]
    first: str
    shown: str
    shown_kind: type[Any]


_PARTS = (
    _Part(
        name="prediction",
        function=predict,
        text="state, known, shown = predict("
        "parameters.prediction, vehicle, memory.known, inputs.state, inputs.actuation, dt)",
        after=False,
        parameters=Prediction,
        memory="known",
        memory_kind=Known,
        first="unknown()",
        shown="shown",
        shown_kind=Shown,
    ),
    _Part(
        name="rotor_lead",
        function=ahead_of_rotors,
        text="output, given, led = ahead_of_rotors(parameters.rotor_lead, vehicle, memory.given, output, dt)",
        after=True,
        parameters=RotorLead,
        memory="given",
        memory_kind=Given,
        first="Given()",
        shown="led",
        shown_kind=LeadShown,
    ),
)

COMPENSATIONS = tuple(part.name for part in _PARTS)
"""Parameter groups of a controller that may stand around its law, each with its own ``enabled``."""

_TEXT = '''\
def step(parameters, vehicle, memory, inputs, dt):
    """Return output, memory and internals of one step of ``dt`` s of the law and what stands around it."""
    state = inputs.state
    {before}
    output, law, internals = law_step(parameters.law, vehicle, memory.law, Inputs({inputs}), dt)
    {after}
    return output, Memory({memory}), Internals({internals})


def init(parameters, vehicle):
    """Return the memory before the first step."""
    return Memory({first})
'''


@cache
def compensated(law: ModuleType, inputs: type[Any], names: frozenset[str]) -> ModuleType:
    """Return the module of ``law`` with those COMPENSATIONS that ``names`` has around it.

    ``inputs`` is the class of what the law's stage takes. ``Parameters`` are (law, one per name), ``Memory`` is (law,
    one per name), ``Internals`` are the law's and what each shows.
    """
    parts = [part for part in _PARTS if part.name in names]
    title = "_".join(part.name for part in parts)
    shown = {key: kind for part in parts for key, kind in field_kinds(part.shown_kind).items()}
    kinds = {
        "Parameters": {"law": law.Parameters, **{part.name: part.parameters for part in parts}},
        "Memory": {"law": law.Memory, **{part.memory: part.memory_kind for part in parts}},
        "Internals": {**field_kinds(law.Internals), **shown},
    }
    module = ModuleType(f"{law.__name__}[{title}]", __doc__)
    found: dict[str, Any] = {
        **{name: _kind(name, f"{law.__name__}_{title}", fields) for name, fields in kinds.items()},
        "COMPILES": getattr(law, "COMPILES", True),
        "PARTS": (*(part.function for part in parts), law.step),
    }
    scope: dict[str, Any] = {**found, "Inputs": inputs, "law_init": law.init, "unknown": unknown, "Given": Given}
    text = _text(law, inputs, parts)

    def assembled(*functions: Any) -> FunctionType:
        """Return ``step`` with these functions in the place of ``PARTS``, as they are or as machine code."""
        called = {part.function.__name__: own for part, own in zip(parts, functions[:-1], strict=True)}
        own = {**scope, **called, "law_step": functions[-1], "__name__": __name__}
        # below the end of this file, so that no traceback shows a line of it that was not run
        exec(compile("\n" * 1000 + text, __file__, "exec"), own)
        for name in ("step", "init"):
            own[name].__qualname__ = f"{name}[{law.__name__}, {title}]"
        vars(module).setdefault("init", own["init"])
        return cast("FunctionType", own["step"])

    vars(module).update(found, assembled=assembled, step=assembled(*found["PARTS"]))
    return module


def _text(law: ModuleType, inputs: type[Any], parts: list[_Part]) -> str:
    """Return the text of ``step`` and ``init``."""
    shown = [f"internals.{name}" for name in law.Internals._fields]
    shown += [f"{part.shown}.{name}" for part in parts for name in part.shown_kind._fields]
    return _TEXT.format(
        before="\n    ".join(part.text for part in parts if not part.after),
        after="\n    ".join(part.text for part in parts if part.after),
        inputs=", ".join("state" if name == "state" else f"inputs.{name}" for name in inputs._fields),
        memory=", ".join(["law", *(part.memory for part in parts)]),
        internals=", ".join(shown),
        first=", ".join(["law_init(parameters.law, vehicle)", *(part.first for part in parts)]),
    )


def _kind(name: str, suffix: str, kinds: dict[str, type[Any]]) -> type[Any]:
    """Return a NamedTuple that pickles by reference: else Numba's file cache never knows it again."""
    made: type[Any] = NamedTuple(name, list(kinds.items()))  # type: ignore[misc]
    made.__module__ = __name__
    made.__qualname__ = f"{name}_{suffix.replace('.', '_')}"
    globals()[made.__qualname__] = made
    return made
