"""CDR payloads as structured NumPy arrays, decoded by ``rosbags`` with the definition that the bag carries.

Nested messages are nested structures, arrays of numbers are sub-arrays, strings are ``object`` columns of str.
Sequences are ``object`` columns of arrays or lists; sequences of messages are lists of dicts.
"""

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from quad_flight_log.errors import FlightLogError, SchemaError, one_line

Table = NDArray[np.void]
Fields = Mapping[str, tuple[Any, Sequence[tuple[str, Any]]]]

TIMES = ("log_ns", "stamp_ns")
MOST_ITEMS = 1_000_000  # of one sequence
_NUMBERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
_CODES = {"bool": "?", "byte": "u1", "char": "u1", **{name: np.dtype(name).str[1:] for name in _NUMBERS}}
_DEEPEST = 30  # levels of messages in messages
_MOST_FIELDS = 10_000  # of a message with all that it holds
_LARGEST = 64 << 20  # bytes of the smallest message of a type
_LONGEST = 256 << 10  # characters of a definition
_SEPARATOR = re.compile(r"^(={80})\s*^\s*MSG:", re.MULTILINE)
_MASKED = re.compile(r"^\s*\S+\s+(\w+)\s*#.*@(?:wall|run)\b", re.MULTILINE)
"""Comments with these words mark fields in which equal flights may differ: a machine's clock, the number of a run."""


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

    def __init__(self, name: str, store: Typestore, masked: Sequence[str] = ()) -> None:
        """Take the type ``name`` from ``store``; fields ``masked`` are no part of the payload hash."""
        self.name, self._store, self._masked = name, store, masked
        self._dtype = _form(store.fielddefs, name, (), {}).dtype
        self.fields = tuple(field for field, _ in store.fielddefs[name][1])
        self._places: dict[int, list[int]] = {}

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
        except Exception as error:  # whatever rosbags raises over bytes that are no message
            raise SchemaError(f"{where}: message {len(messages)}: {one_line(error)}") from error
        stamp = _stamp_path(self._dtype)
        taken = next((field for field in TIMES if field in self.fields), None)
        if taken:
            raise SchemaError(f"{where}: has a field {taken!r}, the name under which times of messages are given")
        times = [("log_ns", np.int64)] + ([("stamp_ns", np.int64)] if stamp else [])
        described: list[Any] = [*times, *((field, self._dtype[field]) for field in self._dtype.names or ())]
        out = np.zeros(len(messages), described)
        logged = np.array(log_times, dtype=np.uint64)
        if len(logged) and logged.max() > np.iinfo(np.int64).max:
            raise FlightLogError(f"{where}: log time {logged.max()} is beyond the year 2262")
        out["log_ns"] = logged.astype(np.int64)
        _fill(out[list(self.fields)], messages)
        if stamp:
            part: Any = out
            for field in stamp:
                part = part[field]
            out["stamp_ns"] = part["sec"].astype(np.int64) * 1_000_000_000 + part["nanosec"].astype(np.int64)
        return out

    def hashed(self, payload: bytes) -> bytes:
        """Return a payload with zeros in its masked fields."""
        if not self._masked:
            return payload
        if len(payload) not in self._places:
            self._places[len(payload)] = self._masked_places(payload)
        row = bytearray(payload)
        for place in self._places[len(payload)]:
            row[place] = 0
        return bytes(row)

    def _masked_places(self, payload: bytes) -> list[int]:
        """Return which bytes differ between a message and the same with all bits of its masked fields turned."""
        message: Any = self._store.deserialize_cdr(payload, self.name)
        changes = {}
        for field in self._masked:
            bits = ~np.frombuffer(np.array(getattr(message, field), self._dtype[field]).tobytes(), np.uint8)
            changes[field] = np.frombuffer(bits.tobytes(), self._dtype[field])[0].item()
        turned = dataclasses.replace(message, **changes)
        one, two = (bytes(self._store.serialize_cdr(each, self.name)) for each in (message, turned))
        return [place for place, (a, b) in enumerate(zip(one, two, strict=True)) if a != b]


def _fill(out: Table, messages: Sequence[Any]) -> None:
    """Write ``messages`` into the rows of ``out``; messages in sequences become dicts."""
    for field in out.dtype.names or ():
        values = [getattr(message, field) for message in messages]
        if out.dtype[field].names is not None:
            _fill(out[field], values)
        elif out.dtype[field].hasobject:
            for index, value in enumerate(values):
                held = isinstance(value, list) and len(value) > 0 and dataclasses.is_dataclass(value[0])
                out[field][index] = [dataclasses.asdict(item, dict_factory=_named) for item in value] if held else value
        elif values:
            out[field] = np.array(values).reshape(len(values), *out.dtype[field].shape)


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
    top = re.split(r"^={80}\s*$", text, maxsplit=1, flags=re.MULTILINE)[0]
    return MessageType(full, store, tuple(_MASKED.findall(top)))


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


class _Form(NamedTuple):
    """How a type lies in memory: a row of a table, and what its smallest message takes, in fields and bytes."""

    dtype: np.dtype[Any]
    fields: int
    bytes: int


def _form(types: Fields, name: str, above: tuple[str, ...], known: dict[str, _Form]) -> _Form:
    """Return the form of a type; raises SchemaError for one that is impossible or too large."""
    if name in known:
        return known[name]
    root = (*above, name)[0]
    if name not in types:
        raise SchemaError(f"{root}: {name} is used and not defined")
    if name in above:
        raise SchemaError(f"{root}: {name} contains itself")
    if len(above) > _DEEPEST:
        raise SchemaError(f"{root}: messages in messages, more than {_DEEPEST} deep")
    fields, size, described = 0, 0, list[Any]()
    names = [field for field, _ in types[name][1]]
    twice = next((field for field in names if names.count(field) > 1), None)
    if twice:
        raise SchemaError(f"{root}: two fields of {name} are called {twice!r}")
    for field, (kind, detail) in types[name][1]:
        many = kind in (Nodetype.ARRAY, Nodetype.SEQUENCE)
        item, count = (detail[0], detail[1]) if many else ((kind, detail), 1)
        if kind == Nodetype.ARRAY and count == 0:
            raise SchemaError(f"{root}: {field!r} is an array of 0 items, expected at least 1")
        code = _CODES.get(item[1][0]) if item[0] == Nodetype.BASE else None
        if item[0] == Nodetype.NAME:
            inner = _form(types, item[1], (*above, name), known)
        elif code or item[1][0] == "string":
            inner = _Form(np.dtype(code or "O"), 1, np.dtype(code or "u4").itemsize)
        else:
            raise SchemaError(f"{root}: {field!r} is of type {item[1][0]}, which is not read")
        fields += inner.fields * (1 if code or kind == Nodetype.SEQUENCE else count)
        size += 4 if kind == Nodetype.SEQUENCE else inner.bytes * count
        if fields > _MOST_FIELDS or size > _LARGEST:
            raise SchemaError(f"{root}: {name} holds more than {_MOST_FIELDS} fields or {_LARGEST} bytes")
        if kind == Nodetype.ARRAY and code:
            described.append((field, code, (count,)))
        else:
            described.append((field, "O" if many else inner.dtype))
    known[name] = _Form(np.dtype(described), max(fields, 1), size)
    return known[name]


def _stamp_path(dtype: np.dtype[Any]) -> tuple[str, ...]:
    """Return where the stamp of a message stands, or empty."""
    for path in (("stamp",), ("header", "stamp"), ("clock",)):
        part: Any = dtype
        for name in path:
            part = part[name] if part is not None and name in (part.names or ()) else None
        if part is not None and part.names == ("sec", "nanosec"):
            return path
    return ()
