"""Installed messages: their classes, and the definition that a bag carries."""

import importlib
import json
import os
import re
import sys
from functools import cache
from pathlib import Path

from quad_flight_log.bag.writer import Definition
from quad_flight_log.errors import SchemaError

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
