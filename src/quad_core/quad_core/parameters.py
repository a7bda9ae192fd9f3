"""One source for a parameter: a NamedTuple field carries default, unit, meaning, bounds and equation.

A parameter set is a NamedTuple whose fields are ``Annotated[float, Real(...)]``,
``Annotated[int, Choice(...)]``, ``Annotated[bool, Flag(...)]``, ``Annotated[int, Whole(...)]`` or another
such NamedTuple. From it come the ROS declaration, the check of every YAML file, the docs page and, as
it is, the argument of the compiled law (Numba takes NamedTuples, not dataclasses).
"""

import difflib
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

Value = float | int | bool | str
_DEGREES = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))deg")


class ParameterError(ValueError):
    """A parameter is unknown, of the wrong type, or out of range; the text names it."""


class Real(NamedTuple):
    """A float with unit, meaning, closed range and where the paper defines it."""

    unit: str
    meaning: str
    low: float
    high: float
    source: str = ""


class Whole(NamedTuple):
    """An integer with unit, meaning and closed range."""

    unit: str
    meaning: str
    low: int
    high: int
    source: str = ""


class Flag(NamedTuple):
    """A switch."""

    meaning: str
    source: str = ""


class Choice(NamedTuple):
    """One of several named options; laws see its number, people see its name.

    ``kind`` is an IntEnum numbered 0, 1, ..., with which the law compares; its names in lower case are the options.
    A tuple of names stands for such an enum that no law compares with.
    """

    kind: type[IntEnum] | tuple[str, ...]
    meaning: str
    source: str = ""

    @property
    def options(self) -> tuple[str, ...]:
        """Return the names of the options by their numbers; raises TypeError if they are not numbered 0, 1, ..."""
        if isinstance(self.kind, tuple):
            return self.kind
        members = list(self.kind)
        if [int(member) for member in members] != list(range(len(members))):
            raise TypeError(f"{self.kind.__name__}: found {members!r}, expected members numbered 0, 1, ... in order")
        return tuple(member.name.lower() for member in members)


class Text(NamedTuple):
    """Free text (names, paths); only for node parameters, never for a law."""

    meaning: str
    source: str = ""


Spec = Real | Whole | Flag | Choice | Text


class Field(NamedTuple):
    """One leaf of a parameter set: dotted name, spec, default as people write it, whether it may change in flight."""

    name: str
    spec: Spec
    default: Value
    live: bool = False


def fields(parameters: type[Any] | Any, prefix: str = "", of_law: bool = False) -> Iterator[Field]:
    """Yield every leaf of a parameter set (class for its defaults, or instance), depth first.

    Numbers and flags of a law (``of_law``) may change in flight, and nothing else: what it remembers keeps its meaning.
    Raises TypeError for a field that is neither annotated nor a parameter set: its value would be lost.
    """
    cls = parameters if isinstance(parameters, type) else type(parameters)
    instance = parameters() if isinstance(parameters, type) else parameters
    for name, hint in get_type_hints(cls, include_extras=True).items():
        value = getattr(instance, name)
        if get_origin(hint) is Annotated:
            spec = get_args(hint)[1]
            shown = spec.options[value] if isinstance(spec, Choice) else value
            yield Field(prefix + name, spec, shown, of_law and isinstance(spec, Real | Flag))
        elif hasattr(value, "_fields"):
            yield from fields(value, f"{prefix}{name}.", of_law)
        else:
            kind = getattr(hint, "__name__", hint)
            expected = f"Annotated[{kind}, ...] with Real, Whole, Flag or Choice"
            raise TypeError(f"{cls.__name__}: found {prefix}{name}: {kind}, expected {expected}")


def flatten(instance: Any) -> dict[str, Value]:
    """Return {dotted name: value as people write it} of a parameter set."""
    return {field.name: field.default for field in fields(instance)}


def radians_of(text: str) -> float | str:
    """Return the angle that ``text`` gives in degrees (``90deg``) in rad; other text as it is."""
    found = _DEGREES.fullmatch(text)
    return float(found[1]) * (math.pi / 180.0) if found else text


def checked(field: Field, value: Any) -> Value:
    """Return ``value`` if ``field`` admits it, else raise ParameterError saying found and expected.

    NumPy's scalars are numbers, and a path is text.
    """
    spec = field.spec
    if getattr(value, "shape", None) == ():
        value = value.item()
    elif isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(spec, Flag):
        if isinstance(value, bool):
            return value
        raise ParameterError(f"{field.name}: found {value!r}, expected true or false")
    if isinstance(spec, Choice | Text):
        if isinstance(value, str) and (isinstance(spec, Text) or value in spec.options):
            return str(value)
        expected = "text" if isinstance(spec, Text) else "one of " + ", ".join(spec.options)
        raise ParameterError(f"{field.name}: found {value!r}, expected {expected}")
    if isinstance(spec, Real) and spec.unit == "rad" and isinstance(value, str):
        value = radians_of(value)
    kind = float if isinstance(spec, Real) else int
    expected = f"{'a number' if kind is float else 'an integer'} in [{spec.low}, {spec.high}] {spec.unit}".rstrip()
    if type(value) not in (kind, int):
        raise ParameterError(f"{field.name}: found {value!r} ({type(value).__name__}), expected {expected}")
    if not (spec.low <= value <= spec.high and math.isfinite(value)):
        raise ParameterError(f"{field.name}: found {value!r}, expected {expected}")
    found: float | int = kind(value)
    return found


def nearest(name: str, known: Sequence[str]) -> str:
    """Return `` (did you mean X?)`` with the one of ``known`` that is most like ``name``, empty if none is."""
    like = difflib.get_close_matches(name, known, 1, 0.5)
    return f" (did you mean {like[0]}?)" if like else ""


def build(default: Any, values: Mapping[str, Any], prefix: str = "") -> Any:
    """Return the parameter set ``default`` (a class or an instance) with ``values`` ({dotted name: value}) put in.

    ``prefix`` only completes the names in errors. Raises ParameterError for an unknown name, a wrong
    type, a NaN or a value out of range.
    """
    known = {field.name: field for field in fields(default)}
    unknown = [name for name in values if name not in known]
    if unknown:
        group = unknown[0].rpartition(".")[0]
        alike = [name for name in known if name.rpartition(".")[0] == group] or list(known)
        shown = ", ".join(prefix + name for name in sorted(alike))
        meant = nearest(prefix + unknown[0], [prefix + name for name in known])
        raise ParameterError(f"{prefix}{unknown[0]}: unknown parameter{meant}; known here: {shown}")
    merged = {
        name: checked(field._replace(name=prefix + name), values.get(name, field.default))
        for name, field in known.items()
    }
    cls = default if isinstance(default, type) else type(default)
    return _assemble(cls, merged, "")


def _assemble(cls: type[Any], values: Mapping[str, Value], prefix: str) -> Any:
    parts: dict[str, Any] = {}
    for name, hint in get_type_hints(cls, include_extras=True).items():
        if get_origin(hint) is Annotated:
            spec, value = get_args(hint)[1], values[prefix + name]
            parts[name] = spec.options.index(value) if isinstance(spec, Choice) else value
        else:
            parts[name] = _assemble(hint, values, f"{prefix}{name}.")
    return cls(**parts)
