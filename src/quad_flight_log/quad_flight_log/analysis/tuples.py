"""Between the tables of a bag and the NamedTuples of ``quad_core.types``: the same names, components in order."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quad_core.records import builder, columns, leaves, to_rows
from quad_core.types import Vec3, Wrench
from quad_flight_log.analysis.metrics import thrust_and_torque
from quad_flight_log.bag.messages import Table
from quad_flight_log.errors import SchemaError

Columns = dict[str, NDArray[Any]]


def tuples_of(kind: type[Any], table: Table, where: str) -> list[Any]:
    """Return each row of ``table`` as a ``kind``; raises SchemaError if the table lacks a field of it."""
    if kind is Wrench:
        thrust, torque = thrust_and_torque(table)
        return [Wrench(up, Vec3(*turn)) for up, turn in zip(thrust.tolist(), torque.tolist(), strict=True)]
    numbers: list[list[Any]] = []
    for column in columns(kind):
        shape = (len(column.parts),) if column.parts else ()
        if column.name not in (table.dtype.names or ()) or table.dtype[column.name].shape != shape:
            raise SchemaError(f"{where}: has no field {column.name!r} of {max(len(column.parts), 1)} numbers")
        values = table[column.name].reshape(len(table), -1)
        numbers += [values[:, place].tolist() for place in range(values.shape[1])]
    return list(map(builder(kind), zip(*numbers, strict=True)))


def columns_of(kind: type[Any], items: Sequence[Any]) -> Columns:
    """Return {leaf name: values, shape (n,)} of NamedTuples."""
    return dict(zip((leaf.name for leaf in leaves(kind)), to_rows(kind, items).T, strict=True))


def recorded_columns(kind: type[Any], table: Table, extra: Sequence[str] = ()) -> Columns:
    """Return the columns of a table that ``columns_of`` gives for its NamedTuple, as far as they were recorded.

    ``extra``: names of the numbers in the field ``extra``, in order.
    """
    if kind is Wrench:
        thrust, torque = thrust_and_torque(table)
        return {"thrust": thrust, **{f"torque_b.{axis}": torque[:, at] for at, axis in enumerate("xyz")}}
    names = table.dtype.names or ()
    found: Columns = {}
    for column in columns(kind):
        parts = [f"{column.name}.{part}" for part in column.parts] or [column.name]
        for place, name in enumerate(parts):
            if column.name in names:
                values = table[column.name].reshape(len(table), -1)[:, place]
                found[name] = values.astype(np.float64)
            elif name in extra and "extra" in names:
                at = list(extra).index(name)
                found[name] = np.array([row[at] for row in table["extra"]], dtype=np.float64)
    return found
