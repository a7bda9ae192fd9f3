"""CDR payloads as structured NumPy arrays, decoded by ``rosbags`` with the definition that the bag carries.

Nested messages are nested structures, arrays of numbers are sub-arrays, strings are ``object`` columns of str.
Sequences are ``object`` columns of arrays or lists; sequences of messages are lists of dicts.
"""

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from quad_flight_log.errors import SchemaError, one_line

Table = NDArray[np.void]

TIMES = ("log_ns", "stamp_ns")
MOST_ITEMS = 1_000_000  # of one sequence
_NUMBERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
_CODES = {"bool": "?", "byte": "u1", "char": "u1", **{name: np.dtype(name).str[1:] for name in _NUMBERS}}
_LONGEST = 256 << 10  # characters of a definition
_SEPARATOR = re.compile(r"^(={80})\s*^\s*MSG:", re.MULTILINE)


def flat_columns(table: Table, prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield (name, values of shape (n,)) of each number, text and sequence: ``wrench.force.z``, ``p_w[0]``."""
    for field in table.dtype.names or ():
        name, values = prefix + field, table[field]
        if values.dtype.names is not None:
            yield from flat_columns(values, f"{name}.")
        elif values.ndim > 1:
            yield from ((f"{name}[{index}]", values[:, index]) for index in range(values.shape[1]))
        else:
            yield name, values


class MessageType:
    """One type of message and what it is made of. ``fields``: its own field names in order."""

    def __init__(self, name: str, store: Typestore) -> None:
        self.name, self._store = name, store
        self.fields = tuple(field for field, _ in store.fielddefs[name][1])

    def same_fields(self, other: "MessageType") -> bool:
        """Return whether two definitions of a type, read from two texts, have the same fields."""
        mine, theirs = self._store.fielddefs, other._store.fielddefs
        return self.name == other.name and all(
            name in theirs and list(fields) == list(theirs[name][1]) for name, (_, fields) in mine.items()
        )

    def table(self, payloads: Sequence[bytes], log_times: Sequence[int], where: str) -> Table:
        """Return messages as one structured array, shape (n,): ``log_ns``, ``stamp_ns`` if they have one, their fields.

        Raises SchemaError naming ``where`` and the message that does not fit the definition.
        """
        messages, decode, name = [], self._store.deserialize_cdr, self.name
        try:
            for payload in payloads:
                messages.append(decode(payload, name))  # noqa: PERF401 (how many there are says which one is bad)
            logged, columns = np.array(log_times, np.int64), self._columns(name, messages)
        except Exception as error:  # whatever rosbags and NumPy raise over bytes that are no message
            raise SchemaError(f"{where}: message {len(messages)}: {one_line(error)}") from error
        taken = next((field for field in TIMES if field in columns), None)
        if taken:
            raise SchemaError(f"{where}: has a field {taken!r}, the name under which times of messages are given")
        return structured({"log_ns": logged, **_stamps(structured(columns)), **columns})

    def _columns(self, name: str, messages: Sequence[Any]) -> dict[str, NDArray[Any]]:
        """Return {field: values, shape (n, ...)} of messages of the type ``name``; nested ones are structured."""
        return {
            field: self._column(kind, detail, [getattr(message, field) for message in messages])
            for field, (kind, detail) in self._store.fielddefs[name][1]
        }

    def _column(self, kind: int, detail: Any, values: list[Any]) -> NDArray[Any]:
        if kind == Nodetype.NAME:
            return structured(self._columns(detail, values))
        if kind == Nodetype.BASE:
            return np.array(values, "O" if detail[0] == "string" else _CODES[detail[0]])
        (item, inner), count = detail
        if kind == Nodetype.ARRAY and item == Nodetype.BASE and inner[0] in _CODES:
            return np.array(values, _CODES[inner[0]]).reshape(len(values), count)
        out = np.empty(len(values), object)
        for index, value in enumerate(values):
            held = isinstance(value, list) and len(value) > 0 and dataclasses.is_dataclass(value[0])
            out[index] = [dataclasses.asdict(each, dict_factory=_named) for each in value] if held else value
        return out


def structured(columns: Mapping[str, NDArray[Any]]) -> Table:
    """Return columns as one structured array."""
    count = len(next(iter(columns.values())))
    out = np.zeros(count, [(name, values.dtype, values.shape[1:]) for name, values in columns.items()])
    for name, values in columns.items():
        out[name] = values
    return out


def part_of(table: Any, path: str) -> Any:
    """Return the values of a field, nested as in ``wrench.force.x``, or None."""
    for name in path.split("."):
        if name not in (table.dtype.names or ()):
            return None
        table = table[name]
    return table


def _stamps(table: Table) -> dict[str, NDArray[np.int64]]:
    """Return {"stamp_ns": stamps of messages}, or nothing where their type lacks stamps."""
    for path in ("stamp", "header.stamp", "clock"):
        time = part_of(table, path)
        if time is not None and time.dtype.names == ("sec", "nanosec"):
            return {"stamp_ns": time["sec"].astype(np.int64) * 1_000_000_000 + time["nanosec"].astype(np.int64)}
    return {}


def _named(fields: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the fields of a message alone: rosbags' classes hold its constants and the name of its type too."""
    return {name: value for name, value in fields if name != "__msgtype__" and not name.isupper()}


@lru_cache(maxsize=256)
def message_type(name: str, text: str) -> MessageType:
    """Return the type that a definition describes (``ros2msg``: its fields, then those of each type that it holds).

    Raises SchemaError if the definition cannot be read, or describes what is too large to be a message.
    """
    full = _full_name(name)
    if len(text) > _LONGEST:
        raise SchemaError(f"definition of {len(text)} characters, more than the {_LONGEST} that are read")
    store = get_typestore(Stores.EMPTY)
    store.max_sequence_length = MOST_ITEMS
    try:
        store.register(get_types_from_msg(_SEPARATOR.sub(r"\1\nMSG:", text), full))
    except Exception as error:  # whatever the parser raises
        raise SchemaError(f"the definition of {full} cannot be read: {one_line(error)}") from error
    return MessageType(full, store)


@lru_cache(maxsize=64)
def known_type(name: str) -> MessageType:
    """Return a type of ROS 2 Jazzy itself, for bags that carry no definitions; raises SchemaError for any other."""
    store = get_typestore(Stores.ROS2_JAZZY)
    if name not in store.fielddefs:
        raise SchemaError(f"the bag carries no definition of {name}, which is no type of ROS 2 itself")
    return MessageType(name, store)


def _full_name(name: str) -> str:
    parts = name.split("/")
    if len(parts) not in (2, 3) or not all(parts):
        raise SchemaError(f"message type {name!r}: expected package/msg/Type")
    return f"{parts[0]}/msg/{parts[-1]}"
