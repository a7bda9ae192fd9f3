"""NamedTuples of ``quad_core.types`` to CDR payloads and back, without a message object between.

A step topic is one flat record, so ``struct`` does in half a microsecond what takes rclpy fifteen: fill a message,
check its fields, convert it to C, serialise it, and the same backwards. The layout comes from the message definition,
the tests hold it against rclpy. What lies between the fields is zero (rclpy leaves there what was in memory), so equal
messages are equal payloads. Read is what every ROS 2 middleware on x86 and ARM sends: plain CDR, little-endian.
"""

import re
import struct
from collections.abc import Callable
from operator import itemgetter
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time

from quad_core.records import builder, flattener, leaves, numbers_finite
from quad_core.types import Vec3, Wrench
from quad_node.handshake import is_foreign

NANOSECONDS = 1_000_000_000


def stamp_ns(stamp: Time) -> int:
    """Return a message stamp as integer nanoseconds."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def set_stamp(stamp: Time, nanoseconds: int) -> None:
    """Write integer nanoseconds into a message stamp."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, NANOSECONDS)


HEADER = b"\x00\x01\x00\x00"
_BODY = 4  # bytes of encapsulation; alignment counts from behind them
_CODES = {"boolean": "?", "uint8": "B", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "double": "d"}
_STEP = struct.Struct("<QI")
_HEAD = ("sec", "nanosec", "step", "run", "next_step", "count")
_FIELD = re.compile(r"(?P<kind>\w+)(?:\[(?P<count>\d+)\])?$")


class ForeignRunError(Exception):
    """A message of another run."""


MALFORMED = (struct.error, RuntimeError, ValueError, AssertionError)
"""What reading a payload that is not the message of its topic may raise, here or in rclpy."""
UNUSABLE = (ForeignRunError, *MALFORMED)


class Stamped(NamedTuple):
    """What a payload held: ``next_step`` is step + 1 where the message lacks it; whether all numbers are finite."""

    step: int
    next_step: int
    stamp_ns: int
    value: Any
    finite: bool


Packer = Callable[[Any, int, int, int], bytes]
Unpacker = Callable[[bytes], Stamped]


def packer(cls: type[Any], message_type: type[Any], run: int = 0) -> Packer:
    """Return ``pack(value, step, next_step, stamp_ns)``, which gives the CDR payload of a ``cls``.

    ``run``: the number of the sender's run. Fields that ``cls`` has not are zero; fields that the message has not go,
    in order, into its ``extra`` sequence. Raises TypeError if it is missing, or for a message that is not flat.
    """
    if cls is Wrench:
        return lambda value, _step, _next_step, stamp: pack_wrench(value, stamp)
    flat, pack = flattener(cls), numbers_packer(cls, message_type, run)
    return lambda value, step, next_step, stamp: pack(flat(value), step, next_step, stamp)


def numbers_packer(cls: type[Any], message_type: type[Any], run: int = 0) -> Packer:
    """Return what ``packer`` does, with a function that takes the numbers of a ``cls`` in the order of ``leaves``."""
    code, order = _layout(cls, message_type)
    extra = [place for place, name in enumerate(_numbers(cls), len(_HEAD)) if place not in order]
    if "extra" in message_type.get_fields_and_field_types():
        code, order = _aligned(code, 4) + "I", [*order, _HEAD.index("count"), *extra]
        code = _aligned(code, 8) + f"{len(extra)}d" if extra else code
    elif extra:
        name = _numbers(cls)[extra[0] - len(_HEAD)]
        raise TypeError(f"{message_type.__name__} has no field {name} of {cls.__name__}")
    pack, pick, count = struct.Struct(_aligned(code, 4)).pack, itemgetter(*order), len(extra)

    def write(flat: tuple[Any, ...], step: int, next_step: int, stamp: int) -> bytes:
        return pack(HEADER, *pick((*divmod(stamp, NANOSECONDS), step, run, next_step, count, *flat)))

    return write


def extra_names(cls: type[Any], message_type: type[Any]) -> list[str]:
    """Return the names of the numbers that travel in ``extra``, in order."""
    known = message_type.get_fields_and_field_types()
    return [leaf.name for leaf in leaves(cls) if leaf.name.partition(".")[0] not in known]


def unpacker(cls: type[Any], message_type: type[Any], plant_period: int = 0, run: int = 0) -> Unpacker:
    """Return ``unpack(payload)``; raises TypeError if the message is not made of exactly the fields of ``cls``.

    ``plant_period`` (ns) is needed for a message that has a stamp and no step: geometry_msgs/WrenchStamped. ``run``:
    the number of the run whose messages are read, 0 for those of every run; ``unpack`` raises ForeignRunError for
    others, and one of MALFORMED for what is no such message.
    """
    if cls is Wrench:
        return lambda payload: unpack_wrench(payload, plant_period)
    code, order = _layout(cls, message_type)
    missing = [name for place, name in enumerate(_numbers(cls), len(_HEAD)) if place not in order]
    if missing:
        raise TypeError(f"{message_type.__name__} has no field {missing[0]} of {cls.__name__}")
    unpack, size, build = struct.Struct(code).unpack_from, struct.calcsize(code), builder(cls)
    places = [1 + order.index(place) for place in range(len(_HEAD), len(_HEAD) + len(_numbers(cls)))]
    # itemgetter of one place returns no tuple
    pick = itemgetter(*places) if len(places) > 1 else itemgetter(slice(places[0], places[0] + 1))
    at = {name: 1 + order.index(place) for place, name in enumerate(_HEAD) if place in order}
    of_run, last = at["run"], at.get("next_step")

    def read(payload: bytes) -> Stamped:
        if payload[:2] != HEADER[:2] or len(payload) < size:
            raise ValueError(f"found {payload[:4].hex()}, expected {HEADER.hex()} and {size} bytes")
        flat = unpack(payload)
        if flat[of_run] != run and is_foreign(flat[of_run], run):  # no call for a message of our own
            raise ForeignRunError
        step, numbers = flat[3], pick(flat)
        stamp, next_step = flat[1] * NANOSECONDS + flat[2], flat[last] if last else step + 1
        return Stamped(step, next_step, stamp, build(numbers), numbers_finite(numbers))

    return read


def names_run(message_type: type[Any]) -> bool:
    """Return whether payloads of a message begin with what ``head_of`` reads."""
    return tuple(message_type.get_fields_and_field_types())[:3] == ("stamp", "step", "run")


def head_of(payload: bytes) -> tuple[int, int]:
    """Return step and number of the run of a payload, -1 and 0 of one in another encoding or that is cut.

    The number is that of a message which has the field ``run``.
    """
    if len(payload) < _BODY + 8 + _STEP.size or payload[:2] != HEADER[:2]:
        return -1, 0
    return _STEP.unpack_from(payload, _BODY + 8)


def _numbers(cls: type[Any]) -> list[str]:
    """Return the field of each number of a ``cls``, in order."""
    return [leaf.name.partition(".")[0] for leaf in leaves(cls)]


def _layout(cls: type[Any], message_type: type[Any]) -> tuple[str, list[int]]:
    """Return the ``struct`` code of a message, and for each number in it its place in (*_HEAD, *numbers of a cls).

    The code ends before the first text and before ``extra``; fields that are neither in _HEAD nor of ``cls`` are
    padding. Raises TypeError for a message that does not begin with stamp and step, or is not flat.
    """
    known = message_type.get_fields_and_field_types()
    if list(known)[:2] != ["stamp", "step"]:
        raise TypeError(f"{message_type.__name__} does not begin with stamp and step")
    places: dict[str, list[int]] = {"step": [2], "run": [3], "next_step": [4]}
    for place, field in enumerate(_numbers(cls), len(_HEAD)):
        places.setdefault(field, []).append(place)
    code, order = "<4siI", [0, 1]
    for name, kind in list(known.items())[1:]:
        if kind == "string" or name == "extra":
            break
        match = _FIELD.match(kind)
        if match is None or match["kind"] not in _CODES:
            raise TypeError(f"{message_type.__name__}.{name}: found {kind}, expected a fixed count of numbers")
        letter, count = _CODES[match["kind"]], int(match["count"] or 1)
        size = struct.calcsize("<" + letter)
        code = _aligned(code, size) + (f"{count}{letter}" if name in places else f"{count * size}x")
        order += places.get(name, [])
    return code, order


def _aligned(code: str, size: int) -> str:
    rest = (struct.calcsize(code) - _BODY) % size
    return code + f"{size - rest}x" if rest else code


# geometry_msgs/WrenchStamped: stamp, frame name with its length, force, torque
FRAME = b"base_link"
_NAME = struct.Struct("<iII")
_WRENCH = struct.Struct("<4siII10s2x6d")
_SIX = struct.Struct("<6d")


def pack_wrench(wrench: Wrench, stamp: int) -> bytes:
    """Return the WrenchStamped payload of ``wrench`` (N along body z, N m) in base_link."""
    head = (HEADER, *divmod(stamp, NANOSECONDS), len(FRAME) + 1, FRAME)
    return _WRENCH.pack(*head, 0.0, 0.0, wrench.thrust, *wrench.torque_b)


def unpack_wrench(payload: bytes, plant_period: int) -> Stamped:
    """Return thrust and torque of a WrenchStamped payload, whose step is its stamp over ``plant_period`` (ns).

    Raises ValueError for another frame than [NAME/]base_link (an empty one means the body), struct.error if it is cut.
    """
    if payload[:2] != HEADER[:2]:
        raise ValueError(f"found {payload[:4].hex()}, expected {HEADER.hex()}")
    sec, nanosec, length = _NAME.unpack_from(payload, _BODY)
    begin = _BODY + _NAME.size
    frame = payload[begin : begin + length - 1]
    if frame and frame != FRAME and not frame.endswith(b"/" + FRAME):
        raise ValueError(f"frame {frame.decode(errors='replace')!r}, expected {FRAME.decode()!r}")
    _, _, *numbers = _SIX.unpack_from(payload, _BODY + (_NAME.size + length + 7) // 8 * 8)
    stamp = sec * NANOSECONDS + nanosec
    step, wrench = stamp // plant_period, Wrench(numbers[0], Vec3(*numbers[1:]))
    return Stamped(step, step + 1, stamp, wrench, numbers_finite(numbers))
