"""Tables of a bag as flat columns with one name and one kind each, whatever part of a topic is read.

``wrench.force.z`` for nested messages, ``p_w[0]`` for arrays. Sequences stay lists, sequences of messages become JSON.
"""

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.bag.cdr import Table
from quad_flight_log.bag.definitions import PRIMITIVES, STRING, Schema

TIMES = ("log_ns", "stamp_ns")


class Column(NamedTuple):
    """One column: its values, shape (n,), and ``form``: a NumPy type code, ``text``, ``list CODE`` or ``list text``."""

    name: str
    form: str
    values: NDArray[Any]


def columns(schema: Schema, table: Table) -> Iterator[Column]:
    """Yield the columns of a table read by ``schema``, the times first."""
    names = table.dtype.names or ()
    for name in TIMES:
        if name in names and name not in {field.name for field in schema.types[schema.root]}:
            yield Column(name, "i8", table[name])
    yield from _of(schema, schema.root, table, "")


def _of(schema: Schema, type_name: str, table: Table, prefix: str) -> Iterator[Column]:
    for field in schema.types[type_name]:
        name, values = prefix + field.name, table[field.name]
        if field.base in schema.types and field.length == 0:
            yield from _of(schema, field.base, values, f"{name}.")
        elif field.base in schema.types:
            yield Column(name, "text", _objects([json.dumps(item, default=_plain) for item in values]))
        elif field.length == 0:
            yield Column(name, PRIMITIVES.get(field.base, "text"), values)
        elif field.base in PRIMITIVES and field.length > 0:
            for index in range(field.length):
                yield Column(f"{name}[{index}]", PRIMITIVES[field.base], values[:, index])
        else:
            code = "text" if field.base == STRING else PRIMITIVES.get(field.base, "text")
            yield Column(name, f"list {code}", _objects([np.asarray(item).tolist() for item in values]))


def _objects(items: list[Any]) -> NDArray[Any]:
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)
