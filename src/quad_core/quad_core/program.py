"""What a node computes in one step, as calls of pure functions on named values.

A node puts values in, runs an entry and gets values out. Whether CPython runs the functions (``Interpreted``) or
machine code that Numba made of the same text (``quad_core.machine_code``) does not change a bit of them.
"""

import math
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Annotated, Any, NamedTuple, Protocol, get_args, get_origin, get_type_hints

NUMBERS = (float, int, bool)


class Call(NamedTuple):
    """One call: names of the values that ``function`` takes and, in the order of its result, of those it gives."""

    function: Callable[..., Any]
    takes: tuple[str, ...]
    gives: tuple[str, ...]


class Program(NamedTuple):
    """``slots``: {name: its NamedTuple class, float, int or bool}; ``entries``: {name: calls, made in order}."""

    name: str
    slots: Mapping[str, type[Any]]
    entries: Mapping[str, tuple[Call, ...]]


class Leaf(NamedTuple):
    """One number of a value: its dotted name (empty where the value is a plain number) and its type."""

    name: str
    kind: type[Any]


class Stepper(Protocol):
    """A program with its values."""

    def put(self, name: str, value: Any) -> None:
        """Set a value."""

    def get(self, name: str) -> Any:
        """Return a value."""

    def numbers(self, name: str) -> tuple[Any, ...]:
        """Return the numbers of a value in the order of ``leaves``."""

    def run(self, entry: str) -> None:
        """Make the calls of one entry."""

    def copy(self, source: str, target: str) -> None:
        """Set ``target`` to the value of ``source``, a slot of the same class."""

    def is_finite(self, name: str) -> bool:
        """Tell whether every number of a value is finite."""


class Interpreted:
    """A program run by CPython."""

    def __init__(self, program: Program) -> None:
        """No value is set yet."""
        self._program, self._entries = program, program.entries
        self._values: dict[str, Any] = {}
        # made when asked for: what CPython alone runs may remember what is no number
        self._flat: dict[str, Callable[[Any], tuple[Any, ...]]] = {}

    def put(self, name: str, value: Any) -> None:
        """Set a value."""
        self._values[name] = value

    def get(self, name: str) -> Any:
        """Return a value."""
        return self._values[name]

    def numbers(self, name: str) -> tuple[Any, ...]:
        """Return the numbers of a value in the order of ``leaves``."""
        if name not in self._flat:
            self._flat[name] = flattener(self._program.slots[name])
        return self._flat[name](self._values[name])

    def run(self, entry: str) -> None:
        """Make the calls of one entry."""
        values = self._values
        for function, takes, gives in self._entries[entry]:
            result = function(*[values[name] for name in takes])
            if len(gives) == 1:
                values[gives[0]] = result
            else:
                values.update(zip(gives, result, strict=True))

    def copy(self, source: str, target: str) -> None:
        """Set ``target`` to the value of ``source``."""
        self._values[target] = self._values[source]

    def is_finite(self, name: str) -> bool:
        """Tell whether every number of a value is finite."""
        return all_finite(self._values[name])


def leaves(kind: type[Any], name: str = "") -> list[Leaf]:
    """Return the numbers of a NamedTuple class in order; raises TypeError for a field that is none."""
    if kind in NUMBERS:
        return [Leaf(name, kind)]
    found = []
    for field, inner in field_kinds(kind, name).items():
        found += leaves(inner, f"{name}.{field}" if name else field)
    return found


def field_kinds(kind: type[Any], name: str = "") -> dict[str, type[Any]]:
    """Return {field: class} of a NamedTuple class; raises TypeError, naming the value, if it is none."""
    if not hasattr(kind, "_fields"):
        raise TypeError(f"{name or 'value'}: found {kind}, expected a number or a NamedTuple of numbers")
    hints = get_type_hints(kind, include_extras=True)
    return {
        field: get_args(hints[field])[0] if get_origin(hints[field]) is Annotated else hints[field]
        for field in kind._fields
    }


def flattener(kind: type[Any]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function from a value to its numbers in the order of ``leaves``."""
    names = [leaf.name for leaf in leaves(kind)]
    if names == [""]:
        return lambda value: (value,)
    pick = attrgetter(*names)
    return pick if len(names) > 1 else lambda value: (pick(value),)


def all_finite(value: Any) -> bool:
    """Tell whether every number of a (nested) NamedTuple is finite."""
    # one sum is enough but for finite numbers that overflow it
    return math.isfinite(_total(value)) or _each_finite(value)


def _total(value: Any) -> float:
    total = 0.0
    for part in value:
        total += _total(part) if isinstance(part, tuple) else part
    return total


def _each_finite(value: Any) -> bool:
    return all(_each_finite(part) if isinstance(part, tuple) else math.isfinite(part) for part in value)
