"""CDR payloads to structured NumPy arrays, by the definition that the bag itself carries.

A topic whose messages all have the same shape (equal string and sequence lengths) is read as one strided view of
its bytes; anything else is read message by message. Both give the same field names: nested messages are nested
structures, strings are ``object`` columns of str. Sequences are sub-arrays where their length is the same in
every message, otherwise ``object`` columns of arrays; sequences of messages are ``object`` columns of lists of dicts.
"""

import struct
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.bag.cdr_reader import EMPTY_STRUCTURE, HEADER, MOST_ITEMS, PayloadReader, byte_order, text_of
from quad_flight_log.bag.definitions import PRIMITIVES, STRING, FieldType, Schema
from quad_flight_log.errors import SchemaError

Table = NDArray[np.void]


class Layout(NamedTuple):
    """Where every field stands in payloads of one shape.

    ``raw`` reads a payload in place (strings as bytes), ``lengths`` are (offset, value) of every length word,
    ``flags`` the offsets of booleans, ``masked`` the (offset, size) of fields that the payload hash leaves out.
    """

    raw: np.dtype[Any]
    lengths: tuple[tuple[int, int], ...]
    flags: tuple[tuple[int, int], ...]
    masked: tuple[tuple[int, int], ...]

    @property
    def fixed(self) -> list[tuple[int, int]]:
        """Where (offset, size) payloads of this shape are equal: byte order and length words."""
        return [(0, 2), *((offset, 4) for offset, _ in self.lengths)]

    def shape_of(self, payload: bytes) -> tuple[bytes | int, ...]:
        """Return what is equal for all payloads of one shape."""
        return len(payload), *(payload[at : at + size] for at, size in self.fixed)


class _IrregularError(Exception):
    """The type holds something that a strided view cannot express."""


def layout_of(schema: Schema, payload: bytes) -> Layout | None:
    """Return the layout of ``payload``, or None where the type needs reading message by message."""
    builder = _LayoutBuilder(schema, payload)
    try:
        raw = builder.structure(schema.root, False)
    except (_IrregularError, struct.error):
        return None
    if not 0 <= len(payload) - builder.at < 4:
        return None
    full = np.dtype({"names": ["_"], "formats": [raw], "offsets": [HEADER], "itemsize": len(payload)})
    return Layout(full, tuple(builder.lengths), tuple(builder.flags), tuple(builder.masked))


class _LayoutBuilder:
    def __init__(self, schema: Schema, payload: bytes) -> None:
        self.types, self.payload, self.at = schema.types, payload, HEADER
        self.order = byte_order(payload, schema.root)
        self.lengths: list[tuple[int, int]] = []
        self.flags: list[tuple[int, int]] = []
        self.masked: list[tuple[int, int]] = []

    def structure(self, name: str, masked: bool) -> np.dtype[Any]:
        start = self.at
        names, formats, offsets = [], [], []
        for field in self.types[name] or (FieldType(EMPTY_STRUCTURE, "uint8", 0, False),):
            form, offset = self.field(field, masked or field.masked)
            names.append(field.name)
            formats.append(form)
            offsets.append(offset - start)
        if self.at > len(self.payload):
            raise _IrregularError
        return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": self.at - start})

    def field(self, field: FieldType, masked: bool) -> tuple[Any, int]:
        if field.base in self.types:
            if field.length != 0:
                raise _IrregularError
            offset = self.at
            return self.structure(field.base, masked), offset
        count = self.length_word() if field.length < 0 else field.length
        if field.base == STRING and field.length == 0:
            return self.text(masked)
        if field.base not in PRIMITIVES:
            raise _IrregularError
        form = np.dtype(PRIMITIVES[field.base]).newbyteorder(self.order)
        if field.length >= 0 or count > 0:
            self.align(form.itemsize)
        offset = self.at
        self.at += form.itemsize * (count if field.length else 1)
        if self.at > len(self.payload):
            raise _IrregularError
        if form.kind == "b" and self.at > offset:
            self.flags.append((offset, self.at - offset))
        if masked:
            self.masked.append((offset, self.at - offset))
        return ((form, (count,)) if field.length else form), offset

    def text(self, masked: bool) -> tuple[Any, int]:
        size = self.length_word()
        offset = self.at
        self.at += size
        if self.at > len(self.payload):
            raise _IrregularError
        if masked:
            self.masked.append((offset, size))
        return f"S{max(size - 1, 1)}" if size > 1 else "V0", offset

    def align(self, size: int) -> None:
        self.at += -(self.at - HEADER) % size

    def length_word(self) -> int:
        self.align(4)
        (value,) = struct.unpack_from(self.order + "I", self.payload, self.at)
        self.lengths.append((self.at, value))
        self.at += 4
        return int(value)


def table(schema: Schema, payloads: list[bytes], where: str) -> Table:
    """Return all messages of a topic as one structured array, shape (n,); ``where`` names file and topic in errors.

    Raises SchemaError if a payload does not fit the definition.
    """
    if not payloads:
        return np.zeros(0, _empty_dtype(schema, schema.root))
    layout = layout_of(schema, payloads[0])
    if layout is not None:
        view = _uniform_view(layout, payloads, where)
        if view is not None:
            return view
    return _message_by_message(schema, payloads, where)


def _uniform_view(layout: Layout, payloads: list[bytes], where: str) -> Table | None:
    size = layout.raw.itemsize
    if any(len(payload) != size for payload in payloads):
        return None
    joined = b"".join(payloads)
    rows = np.frombuffer(joined, np.uint8).reshape(len(payloads), size)
    if any((rows[:, at : at + n] != rows[0, at : at + n]).any() for at, n in layout.fixed):
        return None
    if any((rows[:, at : at + n] > 1).any() for at, n in layout.flags):
        raise SchemaError(f"{where}: a boolean is neither 0 nor 1")
    raw = np.frombuffer(joined, layout.raw)["_"]
    out = np.empty(len(payloads), _native(raw.dtype))
    _copy(out, raw)
    return out


def _native(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the packed dtype in native byte order in which an in-place view is handed out."""
    if dtype.names is not None:
        return np.dtype([(name, _native(dtype[name])) for name in dtype.names])
    if dtype.subdtype is not None:
        return np.dtype((_native(dtype.subdtype[0]), dtype.shape))
    return np.dtype(object) if dtype.kind in "SV" else dtype.newbyteorder("=")


def _copy(out: Table, raw: Table) -> None:
    for name in raw.dtype.names or ():
        form = raw.dtype[name]
        if form.names is not None:
            _copy(out[name], raw[name])
        elif form.kind == "V" and form.subdtype is None:
            out[name] = ""
        elif form.kind == "S":
            distinct, index = np.unique(raw[name], return_inverse=True)
            texts = np.array([text_of(item) for item in distinct.tolist()], dtype=object)
            out[name] = texts[index]
        else:
            out[name] = raw[name]


def _message_by_message(schema: Schema, payloads: list[bytes], where: str) -> Table:
    short = next((index for index, payload in enumerate(payloads) if len(payload) < HEADER + schema.smallest), None)
    if short is not None:  # before the table is allocated
        raise SchemaError(f"{where}: message {short} is shorter than {schema.root} demands")
    dtype = _empty_dtype(schema, schema.root)
    out = np.empty(len(payloads), dtype)
    items = 0
    for index, payload in enumerate(payloads):
        try:
            reader = PayloadReader(schema, payload, where, MOST_ITEMS - items)
            out[index] = reader.structure(schema.root)
            items += reader.read
        except (struct.error, IndexError) as error:
            raise SchemaError(f"{where}: message {index} is shorter than {schema.root} demands") from error
        if not 0 <= len(payload) - reader.at < 4:
            left = len(payload) - reader.at
            raise SchemaError(f"{where}: message {index} has {left} bytes more than {schema.root} demands")
    return out


def decoded(schema: Schema, payload: bytes, where: str) -> dict[str, Any]:
    """Return one message as a dict of Python values (nested messages as dicts)."""
    row = _message_by_message(schema, [payload], where)
    return _as_dict(row[0])


def _as_dict(row: np.void) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name in row.dtype.names or ():
        value = row[name]
        if isinstance(value, np.void):
            value = _as_dict(value)
        elif isinstance(value, np.generic | np.ndarray):
            value = value.tolist()
        out[name] = value
    return out


def _empty_dtype(schema: Schema, name: str) -> np.dtype[Any]:
    described: list[Any] = []
    for field in schema.types[name] or (FieldType(EMPTY_STRUCTURE, "uint8", 0, False),):
        if field.length < 0 or field.base in (STRING, "wstring") or (field.base in schema.types and field.length):
            described.append((field.name, object))
        elif field.base in schema.types:
            described.append((field.name, _empty_dtype(schema, field.base)))
        elif field.length:
            described.append((field.name, PRIMITIVES[field.base], (field.length,)))
        else:
            described.append((field.name, PRIMITIVES[field.base]))
    return np.dtype(described)
