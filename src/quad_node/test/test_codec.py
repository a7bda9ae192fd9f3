"""NamedTuples through real messages and real CDR keep every bit."""

import itertools
import math
from typing import NamedTuple

import pytest
from geometry_msgs.msg import WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message

from quad_core import types
from quad_core.types import Vec3
from quad_msgs import msg
from quad_node.codec import (
    ForeignRunError,
    extra_names,
    head_of,
    pack_wrench,
    packer,
    set_stamp,
    stamp_ns,
    unpack_wrench,
    unpacker,
)

FINITE = st.floats(allow_nan=False, allow_infinity=False)
PAIRS = ["VehicleState", "TrajectoryPoint", "AttitudeThrust", "Actuation", "Disturbance"]


def numbered(cls, numbers):
    parts = []
    for name, kind in cls.__annotations__.items():
        if kind is bool:
            parts.append(next(numbers) > 0.0)
        elif kind is float:
            parts.append(next(numbers))
        else:
            parts.append(kind(*(next(numbers) for _ in kind._fields)))
        assert name
    return cls(*parts)


STAMP, RUN_ID = 3_000_000_007, "123456789"
RUN = 0xCBF43926  # the check value that CRC-32 is published with
HEAD = ("stamp", "step", "run", "next_step")


def same_payload(found, expected, message_type):
    """Equal in all that is read: rclpy leaves what was in memory between fields and behind an empty sequence."""
    behind = len(found) - len(expected)
    return behind in (0, 4) and deserialize_message(found, message_type) == deserialize_message(expected, message_type)


@pytest.mark.parametrize("name", PAIRS)
@settings(deadline=None)
@given(numbers=st.lists(FINITE, min_size=40, max_size=40))
def test_payloads_are_those_of_rclpy_to_the_bit(name, numbers):
    cls, message_type = getattr(types, name), getattr(msg, name)
    value = numbered(cls, iter(numbers))
    payload = packer(cls, message_type, RUN)(value, 7, 12, STAMP)
    message = deserialize_message(payload, message_type)
    assert same_payload(serialize_message(message), payload, message_type)
    assert message.run == RUN
    for field, expected in value._asdict().items():
        shown = getattr(message, field)
        assert repr(shown.tolist() if isinstance(expected, tuple) else shown) == repr(
            list(expected) if isinstance(expected, tuple) else expected
        )
    assert (message.step, getattr(message, "next_step", 12), stamp_ns(message.stamp)) == (7, 12, STAMP)
    back = unpacker(cls, message_type)(payload)
    assert repr(back.value) == repr(value)
    assert back[:3] == (7, 12 if hasattr(message, "next_step") else 8, STAMP)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("head", [b"\x00\x00\x00\x00", b"\x00\x07\x00\x00"])
def test_a_payload_in_another_encoding_is_malformed(name, head):
    cls, message_type = getattr(types, name), getattr(msg, name)
    payload = packer(cls, message_type)(numbered(cls, (0.1 * n for n in range(60))), 7, 12, STAMP)
    with pytest.raises(ValueError, match=f"found {head.hex()}, expected 00010000"):
        unpacker(cls, message_type)(head + payload[4:])
    assert [head_of(each)[0] for each in (payload, payload[:20], head + payload[4:])] == [7, -1, -1]


@pytest.mark.parametrize("name", PAIRS)
def test_a_payload_of_another_run_is_refused(name):
    cls, message_type = getattr(types, name), getattr(msg, name)
    value = numbered(cls, (0.1 * n for n in range(60)))
    theirs, nobodys = (packer(cls, message_type, run)(value, 7, 12, STAMP) for run in (RUN, 0))
    read, ours = (unpacker(cls, message_type, run=run) for run in (RUN, RUN + 1))
    assert read(theirs) == unpacker(cls, message_type)(theirs)
    with pytest.raises(ForeignRunError):
        ours(theirs)
    with pytest.raises(ForeignRunError):
        read(nobodys)
    assert head_of(theirs) == (7, RUN)


class Inside(NamedTuple):
    lyapunov: float
    position_error: Vec3
    own: float
    own_axes: Vec3


def test_what_the_message_has_not_goes_into_extra_in_order_and_what_the_law_has_not_is_zero():
    payload = packer(Inside, msg.PositionInternals)(Inside(1.0, Vec3(2.0, 3.0, 4.0), 5.0, Vec3(6.0, 7.0, 8.0)), 9, 9, 0)
    message = deserialize_message(payload, msg.PositionInternals)
    assert message.step == 9
    assert message.lyapunov == 1.0
    assert message.position_error.tolist() == [2.0, 3.0, 4.0]
    assert message.velocity_error.tolist() == [0.0, 0.0, 0.0]
    assert list(message.extra) == [5.0, 6.0, 7.0, 8.0]
    assert same_payload(serialize_message(message), payload, type(message))
    assert extra_names(Inside, msg.PositionInternals) == ["own", "own_axes.x", "own_axes.y", "own_axes.z"]


def test_a_type_without_extra_refuses_fields_it_has_not():
    with pytest.raises(TypeError, match="VehicleState has no field lyapunov"):
        packer(Inside, msg.VehicleState)
    with pytest.raises(TypeError, match="VehicleState has no field lyapunov"):
        unpacker(Inside, msg.VehicleState)


class Single(NamedTuple):
    thrust: float


def test_a_type_of_one_number_is_read():
    payload = packer(types.Actuation, msg.Actuation)(types.Actuation(thrust=5.0), 9, 9, 0)
    assert unpacker(Single, msg.Actuation)(payload).value == Single(5.0)


def test_wrench_is_physical_in_base_link():
    payload = pack_wrench(types.Wrench(5.0, Vec3(0.1, 0.2, 0.3)), 1_500_000_000)
    message = deserialize_message(payload, WrenchStamped)
    assert same_payload(serialize_message(message), payload, type(message))
    assert message.header.frame_id == "base_link"
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)
    assert (message.wrench.force.x, message.wrench.force.y, message.wrench.force.z) == (0.0, 0.0, 5.0)
    wrench = types.Wrench(5.0, Vec3(0.1, 0.2, 0.3))
    assert unpack_wrench(payload, 2_000_000) == (750, 751, 1_500_000_000, wrench, True)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_payload_says_whether_its_numbers_are_finite(bad):
    for name in PAIRS:
        cls, message_type = getattr(types, name), getattr(msg, name)
        write, read = packer(cls, message_type), unpacker(cls, message_type)
        for place in range(8):
            numbers = [0.1 * n for n in range(60)]
            assert read(write(numbered(cls, iter(numbers)), 7, 12, STAMP)).finite
            numbers[place] = bad
            value = numbered(cls, iter(numbers))
            assert not read(write(value, 7, 12, STAMP)).finite
        large = numbered(cls, itertools.repeat(1e308))
        assert read(write(large, 7, 12, STAMP)).finite


@pytest.mark.parametrize("frame", ["map", "b", "odom", "my_base_link", "base_link/rotor"])
def test_a_wrench_in_another_frame_is_refused(frame):
    message = WrenchStamped()
    message.header.frame_id = frame
    with pytest.raises(ValueError, match="expected 'base_link'"):
        unpack_wrench(serialize_message(message), 2_000_000)


@pytest.mark.parametrize("frame", ["", "base_link", "vehicle_7/base_link"])
def test_a_wrench_in_a_frame_of_any_length_is_read(frame):
    message = WrenchStamped()
    message.header.frame_id = frame
    set_stamp(message.header.stamp, STAMP)
    message.wrench.force.x, message.wrench.force.z, message.wrench.torque.y = 9.0, 5.0, 0.25
    found = unpack_wrench(serialize_message(message), 2_000_000)
    assert (found.value, found.stamp_ns) == (types.Wrench(5.0, Vec3(0.0, 0.25, 0.0)), STAMP)
