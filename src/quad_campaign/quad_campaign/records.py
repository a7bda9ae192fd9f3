"""Lists of NamedTuples as structured NumPy arrays with the field names and shapes of the messages."""

from collections.abc import Sequence
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

_SCALARS = {float: np.dtype(np.float64), int: np.dtype(np.int64), bool: np.dtype(np.bool_)}


def record_type(kind: type[Any]) -> np.dtype[Any]:
    """Return the structured dtype of a NamedTuple class; three floats become one field of shape (3,).

    Raises TypeError naming a field that is neither a number nor such a tuple.
    """
    columns: list[tuple[Any, ...]] = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        inner = get_args(hint)[0] if get_origin(hint) is Annotated else hint
        if inner in _SCALARS:
            columns.append((name, _SCALARS[inner]))
        elif hasattr(inner, "_fields"):
            parts = {get_type_hints(inner)[part] for part in inner._fields}
            scalar = _SCALARS.get(parts.pop()) if len(parts) == 1 else None
            columns.append((name, record_type(inner)) if scalar is None else (name, scalar, (len(inner._fields),)))
        else:
            raise TypeError(f"{kind.__name__}.{name}: found {hint}, expected float, int, bool or a NamedTuple of these")
    return np.dtype(columns)


def to_array(kind: type[Any], items: Sequence[Any]) -> NDArray[Any]:
    """Return ``items``, tuples of class ``kind``, as an array of ``record_type(kind)``."""
    return np.array(items, dtype=record_type(kind))


def with_steps(values: NDArray[Any], period_steps: int, plant_period: int) -> NDArray[Any]:
    """Return ``values`` with ``step``, ``next_step`` and ``stamp_ns`` of their publisher before their own fields."""
    head = [("step", np.int64), ("next_step", np.int64), ("stamp_ns", np.int64)]
    full = np.empty(
        len(values), dtype=np.dtype([*head, *((name, values.dtype[name]) for name in values.dtype.names or ())])
    )
    full["step"] = np.arange(len(values)) * period_steps
    full["next_step"] = full["step"] + period_steps
    full["stamp_ns"] = full["step"] * plant_period
    for name in values.dtype.names or ():
        full[name] = values[name]
    return full
