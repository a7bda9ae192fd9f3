"""NamedTuples of ``quad_core.types`` to CDR payloads and back, without a message object between.

A step topic is one flat record, so ``struct`` does in half a microsecond what takes rclpy fifteen: fill a message,
check its fields, convert it to C, serialise it, and the same backwards. The layout comes from the message definition,
the tests hold it against rclpy. What lies between the fields is zero (rclpy leaves there what was in memory), so equal
messages are equal payloads. Payloads in another encoding (a foreign middleware) go the long way.
"""

import re
import struct
from collections.abc import Callable
from operator import attrgetter
from typing import Any, NamedTuple, get_type_hints

from rclpy.serialization import deserialize_message

from quad_core.types import Vec3, Wrench
from quad_node.conversion import NANOSECONDS, extra_names, reader, stamp_ns

HEADER = b"\x00\x01\x00\x00"
_PLAIN = HEADER[:2]
_BODY = 4  # bytes of encapsulation; alignment counts from behind them
_CODES = {"boolean": "?", "uint8": "B", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "double": "d"}
_FIELD = re.compile(r"(?P<kind>\w+)(?:\[(?P<count>\d+)\])?$")

Packer = Callable[[Any, int, int, int], bytes]


class Stamped(NamedTuple):
    """What a payload held: ``next_step`` is step + 1 where the message has none."""

    step: int
    next_step: int
    stamp_ns: int
    value: Any


class _Layout(NamedTuple):
    """Format of a payload up to ``extra``, its fields beside stamp and steps, and how many steps it begins with."""

    code: str
    names: tuple[str, ...]
    steps: int


def packer(cls: type[Any], message_type: type[Any]) -> Packer:
    """Return ``pack(value, step, next_step, stamp_ns)``, which gives the CDR payload of a ``cls``.

    Fields that ``cls`` has not are zero; fields that the message has not go, in order, into its ``extra`` sequence.
    Raises TypeError if there is none, or for a message that is not flat.
    """
    known = message_type.get_fields_and_field_types()
    own = tuple(name for name in cls._fields if name not in known)
    if own and "extra" not in known:
        raise TypeError(f"{message_type.__name__} has no field {own[0]} of {cls.__name__}")
    layout = _layout(message_type, set(cls._fields))
    count, code = len(extra_names(cls, message_type)), layout.code
    if "extra" in known:
        code = _aligned(code, 4) + "I"
        code = _aligned(code, 8) + f"{count}d" if count else code
    ends = (layout.names, own) if "extra" in known else (layout.names,)
    picks = [_picker(names) for names in ends]
    pack, both = struct.Struct(_aligned(code, 4)).pack, layout.steps == 2

    def write(value: Any, step: int, next_step: int, stamp: int) -> bytes:
        flat: list[Any] = [HEADER, *divmod(stamp, NANOSECONDS), step]
        if both:
            flat.append(next_step)
        for part in picks[0](value):
            if isinstance(part, tuple):
                flat += part
            else:
                flat.append(part)
        if len(picks) > 1:
            flat.append(count)
            for part in picks[1](value):
                flat += part if isinstance(part, tuple) else (part,)
        return pack(*flat)

    return write


def unpacker(cls: type[Any], message_type: type[Any]) -> Callable[[bytes], Stamped]:
    """Return ``unpack(payload)``; raises TypeError if the message is not made of exactly the fields of ``cls``."""
    layout = _layout(message_type, set(cls._fields))
    missing = [name for name in cls._fields if name not in layout.names]
    if missing:
        raise TypeError(f"{message_type.__name__} has no field {missing[0]} of {cls.__name__}")
    unpack, size = struct.Struct(layout.code).unpack_from, struct.calcsize(layout.code)
    hints, at, places = get_type_hints(cls), 3 + layout.steps, {}
    for name in layout.names:
        width = len(getattr(hints[name], "_fields", ()))
        places[name] = (hints[name]._make if width else None, at, at + (width or 1))
        at += width or 1
    plan = [places[name] for name in cls._fields]
    make, both, slow = cls._make, layout.steps == 2, reader(cls, message_type)

    def read(payload: bytes) -> Stamped:
        if payload[:2] != _PLAIN or len(payload) < size:
            message = deserialize_message(payload, message_type)
            next_step = message.next_step if both else message.step + 1
            return Stamped(message.step, next_step, stamp_ns(message.stamp), slow(message))
        flat = unpack(payload)
        step = flat[3]
        value = make([flat[at] if kind is None else kind(flat[at:end]) for kind, at, end in plan])
        return Stamped(step, flat[4] if both else step + 1, flat[1] * NANOSECONDS + flat[2], value)

    return read


def _picker(names: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    if len(names) > 1:
        return attrgetter(*names)
    return lambda value: tuple(getattr(value, name) for name in names)


def _layout(message_type: type[Any], present: set[str]) -> _Layout:
    """Return the layout of a flat message; fields that are not ``present`` are padding."""
    known = dict(message_type.get_fields_and_field_types())
    steps = [name for name in ("stamp", "step", "next_step") if name in known]
    if list(known)[: len(steps)] != steps or steps[:2] != ["stamp", "step"]:
        raise TypeError(f"{message_type.__name__} does not begin with stamp and step")
    code, names = "<4siI" + "Q" * (len(steps) - 1), []
    for name, kind in known.items():
        if name in steps or name == "extra":
            continue
        match = _FIELD.match(kind)
        if match is None or match["kind"] not in _CODES:
            raise TypeError(f"{message_type.__name__}.{name}: found {kind}, expected a fixed count of numbers")
        letter, count = _CODES[match["kind"]], int(match["count"] or 1)
        size = struct.calcsize("<" + letter)
        code = _aligned(code, size) + (f"{count}{letter}" if name in present else f"{count * size}x")
        if name in present:
            names.append(name)
    return _Layout(code, tuple(names), len(steps) - 1)


def _aligned(code: str, size: int) -> str:
    rest = (struct.calcsize(code) - _BODY) % size
    return code + f"{size - rest}x" if rest else code


# geometry_msgs/WrenchStamped: stamp, frame name with its length, force, torque
FRAME = "base_link"
_NAME = struct.Struct("<iII")
_WRENCH = struct.Struct("<4siII10s2x6d")
_SIX = struct.Struct("<6d")


def pack_wrench(wrench: Wrench, stamp: int) -> bytes:
    """Return the WrenchStamped payload of ``wrench`` (N along body z, N m) in base_link."""
    sec, nanosec = divmod(stamp, NANOSECONDS)
    name = FRAME.encode()
    return _WRENCH.pack(HEADER, sec, nanosec, len(name) + 1, name, 0.0, 0.0, wrench.thrust, *wrench.torque_b)


def unpack_wrench(payload: bytes) -> tuple[Wrench, int]:
    """Return thrust, torque and stamp in ns of a WrenchStamped payload."""
    if payload[:2] == _PLAIN:
        sec, nanosec, length = _NAME.unpack_from(payload, _BODY)
        at = _BODY + (_NAME.size + length + 7) // 8 * 8
        _, _, thrust, x, y, z = _SIX.unpack_from(payload, at)
        return Wrench(thrust, Vec3(x, y, z)), sec * NANOSECONDS + nanosec
    from geometry_msgs.msg import WrenchStamped

    message = deserialize_message(payload, WrenchStamped)
    force, torque = message.wrench.force, message.wrench.torque
    return Wrench(force.z, Vec3(torque.x, torque.y, torque.z)), stamp_ns(message.header.stamp)
