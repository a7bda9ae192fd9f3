"""Message definitions as a bag carries them: ``ros2msg`` text and type hash, from the installed interfaces."""

import json
import os
import re
import sys
from collections.abc import Callable
from functools import cache, lru_cache
from pathlib import Path
from typing import NamedTuple

from quad_flight_log.errors import SchemaError

SEPARATOR = "=" * 80

# Primitive types of the ROS 2 interface language and how CDR stores them (NumPy code, size = alignment).
PRIMITIVES = {
    "bool": "?",
    "byte": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
STRING = "string"
DEEPEST = 30  # levels of messages in messages
MOST_FIELDS = 10_000  # of a message with all that it holds
LARGEST = 64 << 20  # bytes of the smallest message of a type

_FIELD = re.compile(
    r"(?P<base>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?P<bound><=)?(?P<count>\d{0,9})\])?\s+(?P<name>[A-Za-z]\w*)(?P<rest>.*)"
)
_MASKED = ("@wall", "@run")
"""Comments with these words mark fields in which equal flights may differ: a machine's clock, the number of a run."""

_BUILTIN = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration", "Header": "std_msgs/Header"}


class Definition(NamedTuple):
    """One message type: ``pkg/msg/Type``, its text with all dependencies, its REP-2016 hash (empty: unknown)."""

    name: str
    text: str
    type_hash: str


class FieldType(NamedTuple):
    """One field of a message. ``length``: -1 sequence, 0 scalar, n array. ``masked``: equal flights may differ."""

    name: str
    base: str
    length: int
    masked: bool


class Schema(NamedTuple):
    """A parsed definition: root type and the fields of it and of every type it holds (names ``pkg/Type``).

    ``smallest``: bytes that one message takes at least, alignment left out.
    """

    root: str
    types: dict[str, tuple[FieldType, ...]]
    smallest: int


def short_name(type_name: str) -> str:
    """Return ``pkg/Type`` of ``pkg/msg/Type`` or ``pkg/Type``."""
    parts = type_name.split("/")
    if len(parts) not in (2, 3) or not all(parts):
        raise SchemaError(f"message type {type_name!r}: expected package/msg/Type")
    return f"{parts[0]}/{parts[-1]}"


def fields_of(type_name: str, text: str) -> tuple[FieldType, ...]:
    """Parse the fields of one ``.msg`` text; constants and default values are skipped.

    Raises SchemaError naming the line that is not ROS 2 interface language.
    """
    found: list[FieldType] = []
    for line in text.splitlines():
        code, _, comment = line.partition("#")
        if not code.strip():
            continue
        match = _FIELD.fullmatch(code.strip())
        if match is None:
            raise SchemaError(f"{type_name}: cannot read the definition line {line.strip()[:80]!r}")
        if match["rest"].lstrip().startswith("="):
            continue
        count = 0
        if match["array"]:
            count = -1 if match["bound"] or not match["count"] else int(match["count"])
            if count == 0:  # would pass for a field that is no array
                raise SchemaError(f"{type_name}: {match['name']!r} is an array of 0 items, expected at least 1")
        base = match["base"]
        if base not in PRIMITIVES and base not in (STRING, "wstring"):
            base = _BUILTIN.get(base, base)
            base = short_name(base if "/" in base else f"{short_name(type_name).split('/')[0]}/{base}")
        if any(field.name == match["name"] for field in found):
            raise SchemaError(f"{type_name}: two fields are called {match['name']!r}")
        found.append(FieldType(match["name"], base, count, any(mark in comment for mark in _MASKED)))
    return tuple(found)


@lru_cache(maxsize=256)
def parse(type_name: str, text: str) -> Schema:
    """Parse concatenated definitions (top text, then for each dependency a line of 80 ``=`` and ``MSG: pkg/Type``).

    Raises SchemaError if a line cannot be read or a type that is used is not defined.
    """
    root = short_name(type_name)
    top, *rest = re.split(r"^={80}\s*$", text, flags=re.MULTILINE)
    types = {root: fields_of(root, top)}
    for part in rest:
        head, _, body = part.lstrip("\r\n").partition("\n")
        if not head.startswith("MSG: "):
            raise SchemaError(f"{type_name}: found {head!r} after a separator, expected 'MSG: package/Type'")
        name = short_name(head[5:].strip())
        types[name] = fields_of(name, body)
    for name, fields in types.items():
        for field in fields:
            if field.base not in PRIMITIVES and field.base not in (STRING, "wstring") and field.base not in types:
                raise SchemaError(f"{type_name}: {name}.{field.name} is of type {field.base}, which is not defined")
    return Schema(root, types, _measured(root, types, (), {}).size)


class _Extent(NamedTuple):
    """What one message of a type takes at least: fields in all, bytes without alignment."""

    fields: int
    size: int


def _measured(
    name: str, types: dict[str, tuple[FieldType, ...]], above: tuple[str, ...], known: dict[str, _Extent]
) -> _Extent:
    """Return the extent of a type; raises SchemaError if it contains itself, or is too deep, wide or large to read."""
    if name in known:
        return known[name]
    if name in above:
        raise SchemaError(f"{above[0]}: {name} contains itself")
    if len(above) > DEEPEST:
        raise SchemaError(f"{above[0]}: messages in messages, more than {DEEPEST} deep")
    fields = size = 0
    for field in types[name]:
        count = max(field.length, 0) if field.length else 1
        if field.base in types:
            inner = _measured(field.base, types, (*above, name), known)
        else:
            inner = _Extent(1, int(PRIMITIVES[field.base][1:] or 1) if field.base in PRIMITIVES else 4)
        fields += inner.fields * (1 if field.length < 0 or field.base in PRIMITIVES else count)
        size += inner.size * count + (4 if field.length < 0 else 0)
    fields, size = max(fields, 1), max(size, 1)
    root = above[0] if above else name
    if fields > MOST_FIELDS:
        raise SchemaError(f"{root}: {name} holds {fields} fields in all, more than the {MOST_FIELDS} that are read")
    if size > LARGEST:
        raise SchemaError(f"{root}: {name} takes {size} bytes, more than the {LARGEST} that are read")
    known[name] = _Extent(fields, size)
    return known[name]


def concatenated(type_name: str, text_of: Callable[[str], str]) -> str:
    """Return the ``ros2msg`` schema text of a type; ``text_of`` gives the .msg text of a ``pkg/Type``."""
    root = short_name(type_name)
    parts, done, todo = [text_of(root).rstrip("\n")], {root}, [root]
    while todo:
        current = todo.pop(0)
        for field in fields_of(current, text_of(current)):
            if "/" in field.base and field.base not in done:
                done.add(field.base)
                todo.append(field.base)
                parts.append(f"{SEPARATOR}\nMSG: {field.base}\n{text_of(field.base).rstrip()}")
    return "\n".join(parts) + "\n"


@cache
def installed(type_name: str) -> Definition:
    """Return the definition of an installed message type, found through AMENT_PREFIX_PATH.

    Raises SchemaError if the package or the message is not installed.
    """
    root = short_name(type_name)
    package, name = root.split("/")
    hashes = json.loads(_share(root, ".json").read_text(encoding="utf-8"))["type_hashes"]
    full = f"{package}/msg/{name}"
    type_hash = next((item["hash_string"] for item in hashes if item["type_name"] == full), "")
    return Definition(full, concatenated(root, lambda key: _share(key, ".msg").read_text(encoding="utf-8")), type_hash)


def _share(short: str, suffix: str) -> Path:
    package, name = short.split("/")
    prefixes = [prefix for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
    for prefix in [*prefixes, sys.prefix]:
        path = Path(prefix, "share", package, "msg", name + suffix)
        if path.is_file():
            return path
    raise SchemaError(f"message type {package}/msg/{name}: no {name}{suffix} in any prefix of AMENT_PREFIX_PATH")


def type_name(kind: type) -> str:
    """Return the name of a message class as interfaces are named: `std_msgs/msg/String`."""
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
