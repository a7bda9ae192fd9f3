"""NamedTuples through real messages and real CDR keep every bit."""

import math
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message

from quad_core import types
from quad_core.types import Vec3
from quad_msgs import msg
from quad_node.conversion import all_finite, extra_names, reader, set_stamp, stamp_ns, writer
from quad_node.wrench import read_wrench, write_wrench

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


@pytest.mark.parametrize("name", PAIRS)
@given(numbers=st.lists(FINITE, min_size=40, max_size=40))
def test_round_trip_through_cdr_keeps_every_bit(name, numbers):
    cls, message_type = getattr(types, name), getattr(msg, name)
    value = numbered(cls, iter(numbers))
    message = message_type()
    writer(cls, message_type)(value, message)
    back = reader(cls, message_type)(deserialize_message(serialize_message(message), message_type))
    assert repr(back) == repr(value)


@pytest.mark.parametrize("name", PAIRS)
def test_message_has_exactly_the_fields_of_the_type_beside_stamp_and_steps(name):
    fields = set(getattr(msg, name).get_fields_and_field_types()) - {"stamp", "step", "next_step"}
    assert fields == set(getattr(types, name)._fields)


class Inside(NamedTuple):
    lyapunov: float
    position_error: Vec3
    own: float
    own_axes: Vec3


def test_what_the_message_has_not_goes_into_extra_in_order():
    message = msg.PositionInternals()
    writer(Inside, msg.PositionInternals)(Inside(1.0, Vec3(2.0, 3.0, 4.0), 5.0, Vec3(6.0, 7.0, 8.0)), message)
    assert message.position_error.tolist() == [2.0, 3.0, 4.0]
    assert list(message.extra) == [5.0, 6.0, 7.0, 8.0]
    assert extra_names(Inside, msg.PositionInternals) == ["own", "own_axes.x", "own_axes.y", "own_axes.z"]


def test_a_type_without_extra_refuses_fields_it_has_not():
    with pytest.raises(TypeError, match="VehicleState has no field lyapunov"):
        writer(Inside, msg.VehicleState)


@given(nanoseconds=st.integers(min_value=0, max_value=2**31 * 10**9 - 1))
def test_stamps_are_exact(nanoseconds):
    message = msg.VehicleState()
    set_stamp(message.stamp, nanoseconds)
    assert stamp_ns(message.stamp) == nanoseconds


def test_wrench_is_physical_in_base_link():
    from geometry_msgs.msg import WrenchStamped

    message = WrenchStamped()
    write_wrench(types.Wrench(5.0, Vec3(0.1, 0.2, 0.3)), 1_500_000_000, message)
    assert message.header.frame_id == "base_link"
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)
    assert (message.wrench.force.x, message.wrench.force.y, message.wrench.force.z) == (0.0, 0.0, 5.0)
    assert read_wrench(message) == types.Wrench(5.0, Vec3(0.1, 0.2, 0.3))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_non_finite_is_seen_wherever_it_stands(bad):
    from geometry_msgs.msg import WrenchStamped

    assert not all_finite(types.Wrench(1.0, Vec3(0.0, bad, 0.0)))
    message = WrenchStamped()
    message.wrench.torque.z = bad
    assert read_wrench(message) is None
