"""A CDR payload read field by field, for messages whose shape varies."""

import struct
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.bag.definitions import PRIMITIVES, STRING, FieldType, Schema
from quad_flight_log.errors import SchemaError

MOST_ITEMS = 1_000_000  # messages and texts in the sequences of one table: each is a Python object
HEADER = 4  # bytes of encapsulation before the data; alignment counts from behind them
EMPTY_STRUCTURE = "structure_needs_at_least_one_member"


def byte_order(payload: bytes, where: str) -> Literal["<", ">"]:
    """Return the NumPy and struct byte order mark of a payload from its encapsulation header."""
    if payload[:2] == b"\x00\x01" and len(payload) >= HEADER:
        return "<"
    if payload[:2] == b"\x00\x00" and len(payload) >= HEADER:
        return ">"
    raise SchemaError(
        f"{where}: payload starts with {payload[:4].hex() or 'nothing'}, expected plain CDR (00 01 or 00 00)"
    )


def text_of(data: bytes) -> str:
    """Return a string of a message; bytes that are not UTF-8 are shown as escapes."""
    return data.decode("utf-8", errors="backslashreplace")


class PayloadReader:
    """One payload, read field by field; every length is checked against the bytes that are left."""

    def __init__(self, schema: Schema, payload: bytes, where: str, most: int) -> None:
        self.types, self.payload, self.where, self.at = schema.types, payload, where, HEADER
        self.most, self.read = most, 0
        self.order = byte_order(payload, where)

    def structure(self, name: str) -> tuple[Any, ...]:
        """Return the fields of a type in order."""
        fields = self.types[name] or (FieldType(EMPTY_STRUCTURE, "uint8", 0, False),)
        return tuple(self._field(field) for field in fields)

    def mapping(self, name: str) -> dict[str, Any]:
        """Return {field: value} of a type."""
        found: dict[str, Any] = {}
        for field in self.types[name] or (FieldType(EMPTY_STRUCTURE, "uint8", 0, False),):
            nested = field.base in self.types and field.length == 0
            found[field.name] = self.mapping(field.base) if nested else self._field(field)
        return found

    def _field(self, field: FieldType) -> Any:
        if field.length == 0:
            return self._value(field.base)
        count = self._number("I") if field.length < 0 else field.length
        if count > len(self.payload) - self.at:
            raise SchemaError(f"{self.where}: {field.name} announces {count} items in {len(self.payload)} bytes")
        if field.base in PRIMITIVES:
            return self._items(field.base, int(count))
        self.read += count
        if self.read > self.most:
            raise SchemaError(f"{self.where}: more than {MOST_ITEMS} messages and texts in sequences, read one by one")
        if field.base in self.types:
            return [self.mapping(field.base) for _ in range(int(count))]
        return [self._value(field.base) for _ in range(int(count))]

    def _value(self, base: str) -> Any:
        if base in self.types:
            return self.structure(base)
        if base == STRING:
            size = self._number("I")
            data = self._take(int(size))
            return text_of(data[:-1])
        if base not in PRIMITIVES:
            raise SchemaError(f"{self.where}: fields of type {base} are not supported")
        return self._items(base, 1)[0]

    def _items(self, base: str, count: int) -> NDArray[Any]:
        form = np.dtype(PRIMITIVES[base]).newbyteorder(self.order)
        if count:
            self.at += -(self.at - HEADER) % form.itemsize
        data = self._take(form.itemsize * count)
        if form.kind == "b" and max(data, default=0) > 1:
            raise SchemaError(f"{self.where}: a boolean is neither 0 nor 1")
        return np.frombuffer(data, form).astype(form.newbyteorder("="))

    def _number(self, code: str) -> int:
        self.at += -(self.at - HEADER) % 4
        (value,) = struct.unpack_from(self.order + code, self.payload, self.at)
        self.at += 4
        return int(value)

    def _take(self, size: int) -> bytes:
        data = self.payload[self.at : self.at + size]
        if len(data) != size:
            raise IndexError
        self.at += size
        return data
