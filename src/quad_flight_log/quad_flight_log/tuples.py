"""Between the tables of a bag and the NamedTuples of ``quad_core.types``: the same names, components in order."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.cdr import Table
from quad_flight_log.errors import SchemaError

Columns = dict[str, NDArray[Any]]


class Leaf(NamedTuple):
    """One number of a NamedTuple: ``field.part`` (or ``field``), its field, its place there, -1 for a plain field."""

    name: str
    field: str
    place: int


def leaves(kind: type[Any]) -> Iterator[Leaf]:
    """Yield the numbers of a NamedTuple class in order."""
    for name, hint in get_type_hints(kind, include_extras=True).items():
        inner = get_args(hint)[0] if get_origin(hint) is Annotated else hint
        parts: tuple[str, ...] = getattr(inner, "_fields", ())
        if parts:
            yield from (Leaf(f"{name}.{part}", name, index) for index, part in enumerate(parts))
        else:
            yield Leaf(name, name, -1)


def tuples_of(kind: type[Any], table: Table, where: str) -> list[Any]:
    """Return each row of ``table`` as a ``kind``; raises SchemaError if the table lacks a field of it."""
    columns = []
    for name, hint in get_type_hints(kind).items():
        if name not in (table.dtype.names or ()):
            raise SchemaError(f"{where}: has no field {name!r}")
        values = table[name].tolist()
        columns.append([hint(*value) for value in values] if hasattr(hint, "_fields") else values)
    return [kind(*values) for values in zip(*columns, strict=True)]


def columns_of(kind: type[Any], items: Sequence[Any]) -> Columns:
    """Return {leaf name: values, shape (n,)} of NamedTuples."""
    found: Columns = {}
    for leaf in leaves(kind):
        at, place = kind._fields.index(leaf.field), leaf.place
        found[leaf.name] = np.array([item[at] if place < 0 else item[at][place] for item in items], dtype=np.float64)
    return found


def recorded_columns(kind: type[Any], table: Table, extra: Sequence[str] = ()) -> Columns:
    """Return the columns of a table that ``columns_of`` gives for its NamedTuple, as far as they were recorded.

    ``extra``: names of the numbers in the field ``extra``, in order.
    """
    names = table.dtype.names or ()
    found: Columns = {}
    for leaf in leaves(kind):
        if leaf.field in names:
            values = table[leaf.field] if leaf.place < 0 else table[leaf.field][:, leaf.place]
            found[leaf.name] = values.astype(np.float64)
        elif leaf.name in extra and "extra" in names:
            at = list(extra).index(leaf.name)
            found[leaf.name] = np.array([row[at] for row in table["extra"]], dtype=np.float64)
    return found
