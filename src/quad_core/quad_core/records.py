"""NamedTuples as flat numbers, and back: the only place that knows how.

A value is a number (float, int, bool) or a NamedTuple of values. Its leaves are its numbers, depth first; its columns
are its fields, of which a Vec3 is one of shape (3,), as in the messages.
"""

import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

NUMBERS = (float, int, bool)
_SCALARS = {float: np.dtype(np.float64), int: np.dtype(np.int64), bool: np.dtype(np.bool_)}


class Leaf(NamedTuple):
    """One number of a value: its dotted name (empty where the value is a plain number) and its type."""

    name: str
    kind: type[Any]


def field_kinds(kind: type[Any], name: str = "") -> dict[str, type[Any]]:
    """Return {field: class} of a NamedTuple class; raises TypeError, naming the value ``name``, for any other class."""
    if not hasattr(kind, "_fields"):
        raise TypeError(f"{name or 'value'}: found {kind}, expected a number or a NamedTuple of numbers")
    hints = get_type_hints(kind, include_extras=True)
    return {
        field: get_args(hints[field])[0] if get_origin(hints[field]) is Annotated else hints[field]
        for field in kind._fields
    }


def leaves(kind: type[Any], name: str = "") -> list[Leaf]:
    """Return the numbers of a class in order; raises TypeError for any other field."""
    if kind in NUMBERS:
        return [Leaf(name, kind)]
    found = []
    for field, inner in field_kinds(kind, name).items():
        found += leaves(inner, f"{name}.{field}" if name else field)
    return found


def referable(name: str, suffix: str, kinds: dict[str, type[Any]], module: str) -> type[Any]:
    """Return a NamedTuple class that pickles by reference, as ``name``_``suffix`` of ``module``, for Numba's cache."""
    made: type[Any] = NamedTuple(name, list(kinds.items()))  # type: ignore[misc]
    made.__module__ = module
    made.__qualname__ = f"{name}_{suffix.replace('.', '_')}"
    setattr(sys.modules[module], made.__qualname__, made)
    return made


def flattener(kind: type[Any]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function from a value to its numbers in the order of ``leaves``."""
    names = [leaf.name for leaf in leaves(kind)]
    if names == [""]:
        return lambda value: (value,)
    pick = attrgetter(*names)
    return pick if len(names) > 1 else lambda value: (pick(value),)


def builder(kind: type[Any]) -> Callable[[Sequence[Any]], Any]:
    """Return the inverse of ``flattener``: a function from the numbers of a value to it."""
    if kind in NUMBERS:
        return lambda numbers: numbers[0]
    make = partial(tuple.__new__, kind)  # _make calls it, and counts the numbers again
    plan: list[tuple[Callable[[Sequence[Any]], Any] | None, int, int]] = []
    at = 0
    for inner in field_kinds(kind).values():
        width = len(leaves(inner))
        plan.append((None if inner in NUMBERS else builder(inner), at, at + width))
        at += width
    if all(inner is None for inner, _, _ in plan):
        return make
    return lambda numbers: make([numbers[at] if inner is None else inner(numbers[at:end]) for inner, at, end in plan])


def dtype_of(kind: type[Any]) -> np.dtype[Any]:
    """Return NumPy's type of the columns of a NamedTuple class.

    Raises TypeError naming a field that is neither a number nor a NamedTuple of numbers of one type.
    """
    found = []
    for name, inner in field_kinds(kind).items():
        parts: tuple[str, ...] = getattr(inner, "_fields", ())
        kinds = set(field_kinds(inner).values()) if parts else {inner}
        scalar = _SCALARS.get(kinds.pop()) if len(kinds) == 1 else None
        if scalar is None:
            raise TypeError(f"{kind.__name__}.{name}: found {inner}, expected a number or a NamedTuple of numbers")
        found.append((name, scalar, (len(parts),) if parts else ()))
    return np.dtype(found)


def numbers_finite(numbers: Sequence[float]) -> bool:
    """Return whether all numbers of a flat sequence are finite."""
    # one sum is enough but for finite numbers that overflow it
    return math.isfinite(sum(numbers)) or all(map(math.isfinite, numbers))


Check = Callable[[Any], bool]


def finite_check(kind: type[Any]) -> Check:
    """Return a function that tells whether every number of a ``kind`` is finite; CPython and Numba run it.

    The node and the loop without ROS both use it, so that they refuse the same answers at the same step.
    """
    if kind in NUMBERS:
        return _is_finite if kind is float else _always
    parts = tuple(field_kinds(kind).values())
    if parts == (float, float, float):
        return _are_three_finite
    check: Check = _always
    for at, part in enumerate(parts):
        check = _and_part(check, at, finite_check(part))
    return check


def _always(_: Any) -> bool:
    return True


def _is_finite(number: float) -> bool:
    return math.isfinite(number)


def _are_three_finite(v: Any) -> bool:
    return math.isfinite(v[0]) & math.isfinite(v[1]) & math.isfinite(v[2])


def _and_part(before: Check, at: int, part: Check) -> Check:
    # without branches, which take the compiled loop three times as long
    return lambda value: before(value) & part(value[at])
