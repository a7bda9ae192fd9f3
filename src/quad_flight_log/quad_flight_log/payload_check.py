"""Installed messages, and whether bytes are one of their topic's type: what none could decode never enters a bag.

Stricter than rclpy: little endian alone, texts in UTF-8 with their zero byte, as readers of others demand.
"""

import importlib
import json
import os
import re
import sys
from collections.abc import Callable
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import Any

from quad_flight_log.errors import SchemaError, one_line
from quad_flight_log.writer import Definition

_NESTED = re.compile(r"\w+/\w+")


@cache
def message_class(short: str) -> type:
    """Return the class of ``package/Type``."""
    package, _, name = short.partition("/")
    found: type = getattr(importlib.import_module(f"{package}.msg"), name)
    return found


def type_name(kind: type) -> str:
    """Return the name of a message class as interfaces are named: `std_msgs/msg/String`."""
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"


@cache
def definition_of(kind: type) -> Definition:
    """Return the definition of an installed message with those of all messages that it holds, and its type hash.

    Raises SchemaError if the message is not in any prefix of AMENT_PREFIX_PATH.
    """
    name = type_name(kind)
    hashes = json.loads(_share(kind, ".json").read_text(encoding="utf-8"))["type_hashes"]
    parts: list[str] = []
    todo = [kind]
    for each in todo:
        head = f"{'=' * 80}\nMSG: {type_name(each).replace('/msg/', '/')}\n" if parts else ""
        parts.append(head + _share(each, ".msg").read_text(encoding="utf-8").rstrip() + "\n")
        fields = each.get_fields_and_field_types()  # type: ignore[attr-defined]
        inner = map(message_class, _NESTED.findall(" ".join(fields.values())))
        todo += [one for one in dict.fromkeys(inner) if one not in todo]
    type_hash = next((item["hash_string"] for item in hashes if item["type_name"] == name), "")
    return Definition(name, "".join(parts), type_hash)


def _share(kind: type, suffix: str) -> Path:
    package, _, name = type_name(kind).split("/")
    prefixes = [prefix for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
    for prefix in [*prefixes, sys.prefix]:
        path = Path(prefix, "share", package, "msg", name + suffix)
        if path.is_file():
            return path
    raise SchemaError(f"message type {package}/msg/{name}: no {name}{suffix} in any prefix of AMENT_PREFIX_PATH")


SIZES = {"boolean": 1, "octet": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4,
         "int64": 8, "uint64": 8, "float": 4, "double": 8}  # fmt: skip
_KIND = re.compile(r"(?:sequence<)?(?P<base>[\w/]+(?:<\d+>)?)(?:, \d+)?(?P<end>>|\[(?P<count>\d+)\])?")
_HEADER = 4  # bytes of encapsulation before the data; alignment counts from behind them
_PLAIN = b"\x00\x01"
_MOST_ITEMS = 10_000  # messages or texts in one sequence; reading them takes time and memory
_MOST_PADDING = 3  # bytes behind the last field


def payload_check(kind: type) -> Callable[[bytes], str]:
    """Return a function that says what is wrong with a CDR payload of the message class ``kind``, empty if nothing."""
    name, fields = type_name(kind), _fields(kind)
    first = list(takewhile(_is_fixed, fields))  # their end is that of every message
    begin, rest = _end(first, bytes(1 << 16), _HEADER), fields[len(first) :]

    def problem_of(payload: bytes) -> str:
        if payload[:2] != _PLAIN:
            return f"found {payload[:2].hex() or 'nothing'}, expected 0001 (little-endian CDR) of {name}"
        try:
            whole = len(payload) >= begin
            left = len(payload) - (_end(rest, payload, begin) if whole else _end(fields, payload, _HEADER))
        except ValueError as error:
            return f"{one_line(error)} in {len(payload)} bytes of {name}"
        return f"found {left} bytes behind the last field of {name}" if left > _MOST_PADDING else ""

    return problem_of


Field = tuple[str, Any, int]  # name; bytes of one number, ``string`` or a message class; how many, -1 for a sequence


@cache
def _fields(kind: type) -> list[Field]:
    """Return the fields of a message class.

    Raises SchemaError for a kind of field that is not recorded.
    """
    found: list[Field] = []
    for field, text in kind.get_fields_and_field_types().items():  # type: ignore[attr-defined]
        match = _KIND.fullmatch(text)
        base = match["base"].partition("<")[0] if match else ""
        if match is None or (base not in SIZES and base != "string" and "/" not in base):
            raise SchemaError(f"{type_name(kind)}: {field}: fields of type {text} are not recorded")
        content = message_class(base) if "/" in base else SIZES.get(base, base)
        found.append((field, content, -1 if match["end"] == ">" else int(match["count"] or 1)))
    return found or [("nothing", 1, 1)]


def _is_fixed(field: Field) -> bool:
    """Return whether a field takes the same place in all messages."""
    _, content, count = field
    return count > 0 and (isinstance(content, int) or (content != "string" and all(map(_is_fixed, _fields(content)))))


def _end(fields: list[Field], payload: bytes, at: int) -> int:
    """Return where fields of which the first begins at ``at`` end; raises ValueError."""
    for name, content, count in fields:
        number = count
        if count < 0:
            number, at = _length(payload, at)
        if isinstance(content, int):
            at = at - (at - _HEADER) % -content + content * number if number else at
        elif number > _MOST_ITEMS:
            raise ValueError(f"{name}: found more than {_MOST_ITEMS} items")
        else:
            for _ in range(number):
                at = _text_end(payload, at, name) if content == "string" else _end(_fields(content), payload, at)
                if at > len(payload):
                    break
        if at > len(payload):
            raise ValueError(f"{name}: it ends early")
    return at


def _length(payload: bytes, at: int) -> tuple[int, int]:
    """Return the length of a sequence or text, and where its content begins."""
    at -= (at - _HEADER) % -4
    return int.from_bytes(payload[at : at + 4], "little"), at + 4


def _text_end(payload: bytes, at: int, name: str) -> int:
    size, at = _length(payload, at)
    text = payload[at : at + size]
    if text[-1:] != b"\0" and at + size <= len(payload):
        raise ValueError(f"{name}: found a text without its zero byte")
    try:
        text.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{name}: {error}") from error
    return at + size
