"""NamedTuples of ``quad_core.types`` to CDR payloads and back, without a message object between.

A step topic is one flat record, so ``struct`` does in half a microsecond what takes rclpy fifteen: fill a message,
check its fields, convert it to C, serialise it, and the same backwards. The layout comes from the message definition,
the tests hold it against rclpy. What lies between the fields is zero (rclpy leaves there what was in memory), so equal
messages are equal payloads. Payloads in another encoding (a foreign middleware) go the long way.
"""

import re
import struct
from collections.abc import Callable
from operator import itemgetter
from typing import Any, NamedTuple, get_type_hints

from rclpy.serialization import deserialize_message

from quad_core.records import all_finite, flattener, leaves, numbers_finite
from quad_core.types import Vec3, VehicleState, Wrench
from quad_node.conversion import NANOSECONDS, reader, stamp_ns

HEADER = b"\x00\x01\x00\x00"
_PLAIN = HEADER[:2]
_BODY = 4  # bytes of encapsulation; alignment counts from behind them
_CODES = {"boolean": "?", "uint8": "B", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "double": "d"}
_STEP = struct.Struct("<QI")
_HEAD = ("stamp", "step", "run", "next_step")
_FIELD = re.compile(r"(?P<kind>\w+)(?:\[(?P<count>\d+)\])?$")


class ForeignRunError(Exception):
    """A message of another run."""


MALFORMED = (struct.error, RuntimeError, ValueError, AssertionError)
"""What reading a payload that is not the message of its topic may raise."""

Packer = Callable[[Any, int, int, int], bytes]


class Stamped(NamedTuple):
    """What a payload held: ``next_step`` is step + 1 where the message lacks it; whether all numbers are finite."""

    step: int
    next_step: int
    stamp_ns: int
    value: Any
    finite: bool


class _Layout(NamedTuple):
    """Format of a payload up to ``extra``, its fields other than those of ``head``, which of _HEAD it begins with."""

    code: str
    names: tuple[str, ...]
    head: tuple[str, ...]


def packer(cls: type[Any], message_type: type[Any], run: int = 0) -> Packer:
    """Return ``pack(value, step, next_step, stamp_ns)``, which gives the CDR payload of a ``cls``.

    ``run``: the number of the sender's run. Fields that ``cls`` has not are zero; fields that the message has not go,
    in order, into its ``extra`` sequence. Raises TypeError if it is missing, or for a message that is not flat.
    """
    if cls is Wrench:
        return _pack_stamped_wrench
    flat, pack = flattener(cls), numbers_packer(cls, message_type, run)
    return lambda value, step, next_step, stamp: pack(flat(value), step, next_step, stamp)


def numbers_packer(cls: type[Any], message_type: type[Any], run: int = 0) -> Packer:
    """Return what ``packer`` does, with a function that takes the numbers of a ``cls`` in the order of ``leaves``."""
    known = message_type.get_fields_and_field_types()
    own = tuple(name for name in cls._fields if name not in known)
    if own and "extra" not in known:
        raise TypeError(f"{message_type.__name__} has no field {own[0]} of {cls.__name__}")
    layout = _layout(message_type, set(cls._fields))
    code, body, tail = layout.code, _places(cls, layout.names), _places(cls, own)
    if "extra" in known:
        code = _aligned(code, 4) + "I"
        code = _aligned(code, 8) + f"{len(tail)}d" if tail else code
    pack, head = struct.Struct(_aligned(code, 4)).pack, _picker([_HEAD.index(name) - 1 for name in layout.head[1:]])
    pick, rest, extra = _picker(body), _picker(tail), "extra" in known

    def write(flat: tuple[Any, ...], step: int, next_step: int, stamp: int) -> bytes:
        steps = head((step, run, next_step))
        if extra:
            return pack(HEADER, *divmod(stamp, NANOSECONDS), *steps, *pick(flat), len(tail), *rest(flat))
        return pack(HEADER, *divmod(stamp, NANOSECONDS), *steps, *pick(flat))

    return write


def unpacker(
    cls: type[Any], message_type: type[Any], plant_period: int = 0, run: int = 0
) -> Callable[[bytes], Stamped]:
    """Return ``unpack(payload)``; raises TypeError if the message is not made of exactly the fields of ``cls``.

    ``plant_period`` (ns) is needed for a message that has a stamp and no step: geometry_msgs/WrenchStamped. ``run``:
    the number of the run whose messages are read, 0 for those of every run; ``unpack`` raises ForeignRunError for
    others.
    """
    if cls is Wrench:
        return lambda payload: _stamped_wrench(*unpack_wrench(payload), plant_period)
    layout = _layout(message_type, set(cls._fields))
    missing = [name for name in cls._fields if name not in layout.names]
    if missing:
        raise TypeError(f"{message_type.__name__} has no field {missing[0]} of {cls.__name__}")
    unpack, size = struct.Struct(layout.code).unpack_from, struct.calcsize(layout.code)
    hints, at, places = get_type_hints(cls), 2 + len(layout.head), {}
    for name in layout.names:
        width = len(getattr(hints[name], "_fields", ()))
        places[name] = (hints[name]._make if width else None, at, at + (width or 1))
        at += width or 1
    plan = [places[name] for name in cls._fields]
    make, both, slow = cls._make, layout.head[-1] == "next_step", reader(cls, message_type)
    last, of_run = 1 + len(layout.head), run if "run" in layout.head else 0

    def read(payload: bytes) -> Stamped:
        if payload[:2] != _PLAIN or len(payload) < size:
            message = deserialize_message(payload, message_type)
            if of_run and message.run != of_run:
                raise ForeignRunError
            next_step = message.next_step if both else message.step + 1
            value = slow(message)
            return Stamped(message.step, next_step, stamp_ns(message.stamp), value, all_finite(value))
        flat = unpack(payload)
        if of_run and flat[4] != of_run:
            raise ForeignRunError
        step = flat[3]
        value = make([flat[at] if kind is None else kind(flat[at:end]) for kind, at, end in plan])
        finite = numbers_finite(flat[1:])
        return Stamped(step, flat[last] if both else step + 1, flat[1] * NANOSECONDS + flat[2], value, finite)

    return read


def names_run(message_type: type[Any]) -> bool:
    """Return whether payloads of a message begin with what ``head_of`` reads."""
    return tuple(message_type.get_fields_and_field_types())[:3] == _HEAD[:3]


def head_of(payload: bytes) -> tuple[int, int]:
    """Return step and number of the run of a payload in our encoding, -1 and 0 of any other or of one that is cut.

    The number is that of a message which has the field ``run``.
    """
    if len(payload) < _BODY + 8 + _STEP.size or payload[:2] != _PLAIN:
        return -1, 0
    return _STEP.unpack_from(payload, _BODY + 8)


def step_of(payload: bytes) -> int:
    """Return the step of a payload in our encoding, -1 of any other or of one that is cut."""
    return head_of(payload)[0]


def _places(cls: type[Any], names: tuple[str, ...]) -> list[int]:
    """Return where the numbers of the fields ``names`` stand among those of a ``cls``."""
    of_field: dict[str, list[int]] = {}
    for place, leaf in enumerate(leaves(cls)):
        of_field.setdefault(leaf.name.partition(".")[0], []).append(place)
    return [place for name in names for place in of_field[name]]


def _picker(places: list[int]) -> Callable[[tuple[Any, ...]], tuple[Any, ...]]:
    if places == list(range(len(places))):
        return itemgetter(slice(len(places)))
    return itemgetter(*places) if len(places) > 1 else itemgetter(slice(places[0], places[0] + 1))


def _layout(message_type: type[Any], present: set[str]) -> _Layout:
    """Return the layout of a flat message; fields that are not ``present`` are padding."""
    known = dict(message_type.get_fields_and_field_types())
    head = [name for name in _HEAD if name in known]
    if list(known)[: len(head)] != head or head[:2] != ["stamp", "step"]:
        raise TypeError(f"{message_type.__name__} does not begin with stamp and step")
    code, names = "<4siIQ" + "I" * ("run" in head), []
    if "next_step" in head:
        code = _aligned(code, 8) + "Q"
    for name, kind in known.items():
        if kind == "string":  # text comes last and is not read here
            break
        if name in head or name == "extra":
            continue
        match = _FIELD.match(kind)
        if match is None or match["kind"] not in _CODES:
            raise TypeError(f"{message_type.__name__}.{name}: found {kind}, expected a fixed count of numbers")
        letter, count = _CODES[match["kind"]], int(match["count"] or 1)
        size = struct.calcsize("<" + letter)
        code = _aligned(code, size) + (f"{count}{letter}" if name in present else f"{count * size}x")
        if name in present:
            names.append(name)
    return _Layout(code, tuple(names), tuple(head))


def _aligned(code: str, size: int) -> str:
    rest = (struct.calcsize(code) - _BODY) % size
    return code + f"{size - rest}x" if rest else code


# geometry_msgs/WrenchStamped: stamp, frame name with its length, force, torque
FRAME, MAP = "base_link", "map"
_FRAME = FRAME.encode()
_NAME = struct.Struct("<iII")
_WRENCH = struct.Struct("<4siII10s2x6d")
_SIX = struct.Struct("<6d")
_CLOCK = struct.Struct("<4siI")
_COVARIANCE = 36 * 8
# nav_msgs/Odometry: stamp, both frame names, pose and its covariance, twist and its covariance
_ODOMETRY = struct.Struct(f"<4siII4sI10s2x7d{_COVARIANCE}x6d{_COVARIANCE}x")


def pack_wrench(wrench: Wrench, stamp: int) -> bytes:
    """Return the WrenchStamped payload of ``wrench`` (N along body z, N m) in base_link."""
    sec, nanosec = divmod(stamp, NANOSECONDS)
    name = FRAME.encode()
    return _WRENCH.pack(HEADER, sec, nanosec, len(name) + 1, name, 0.0, 0.0, wrench.thrust, *wrench.torque_b)


def pack_clock(stamp: int) -> bytes:
    """Return the rosgraph_msgs/Clock payload of ``stamp`` ns."""
    return _CLOCK.pack(HEADER, *divmod(stamp, NANOSECONDS))


def pack_odometry(state: VehicleState, velocity_b: Vec3, stamp: int) -> bytes:
    """Return the nav_msgs/Odometry payload: pose of base_link in map, twist in base_link, covariances zero."""
    sec, nanosec = divmod(stamp, NANOSECONDS)
    world, body = MAP.encode(), FRAME.encode()
    return _ODOMETRY.pack(
        HEADER,
        sec,
        nanosec,
        len(world) + 1,
        world,
        len(body) + 1,
        body,
        *state.p_w,
        *state.q_wb,
        *velocity_b,
        *state.omega_b,
    )


def _pack_stamped_wrench(wrench: Wrench, step: int, next_step: int, stamp: int) -> bytes:  # noqa: ARG001 (a Packer)
    return pack_wrench(wrench, stamp)


def _expect_body(frame: bytes) -> None:
    """Refuse the wrench of another frame than [NAME/]base_link; an empty frame means the body."""
    if frame and frame != _FRAME and not frame.endswith(b"/" + _FRAME):
        raise ValueError(f"frame {frame.decode(errors='replace')!r}, expected {FRAME!r}")


def _stamped_wrench(wrench: Wrench, stamp: int, plant_period: int) -> Stamped:
    step = stamp // plant_period
    return Stamped(step, step + 1, stamp, wrench, all_finite(wrench))


def unpack_wrench(payload: bytes) -> tuple[Wrench, int]:
    """Return thrust, torque and stamp in ns of a WrenchStamped payload; one of another frame is a ValueError."""
    if payload[:2] == _PLAIN:
        sec, nanosec, length = _NAME.unpack_from(payload, _BODY)
        begin = _BODY + _NAME.size
        _expect_body(payload[begin : begin + length - 1])
        at = _BODY + (_NAME.size + length + 7) // 8 * 8
        _, _, thrust, x, y, z = _SIX.unpack_from(payload, at)
        return Wrench(thrust, Vec3(x, y, z)), sec * NANOSECONDS + nanosec
    from geometry_msgs.msg import WrenchStamped

    message = deserialize_message(payload, WrenchStamped)
    _expect_body(message.header.frame_id.encode())
    force, torque = message.wrench.force, message.wrench.torque
    return Wrench(force.z, Vec3(torque.x, torque.y, torque.z)), stamp_ns(message.header.stamp)
