"""Where the laws may be called."""

import math

import pytest

from quad_core.cycle import is_faulty, is_flyable
from quad_core.types import NO_SENSOR_FAULT, Quat, Vec3, VehicleState


def state_with(index, value):
    numbers = [0.0] * 9 + [1.0] + [0.0] * 3
    numbers[index] = value
    return VehicleState(Vec3(*numbers[:3]), Vec3(*numbers[3:6]), Quat(*numbers[6:10]), Vec3(*numbers[10:]))


BOUNDS = [1e4] * 3 + [1e3] * 3 + [None] * 4 + [1e3] * 3


@pytest.mark.parametrize("index", range(13))
def test_every_number_is_checked(index):
    for bad in (math.nan, math.inf, -math.inf, 1.1e4, -1.1e4):
        assert not is_flyable(state_with(index, bad))
    bound = BOUNDS[index]
    if bound is not None:
        assert is_flyable(state_with(index, bound))
        assert is_flyable(state_with(index, -bound))
        assert not is_flyable(state_with(index, math.nextafter(bound, math.inf)))


def test_quaternion_must_have_length_one():
    half = Quat(0.5, -0.5, 0.5, -0.5)
    assert is_flyable(VehicleState(q_wb=half))
    for scale, verdict in ((1.0009, True), (0.9991, True), (1.0011, False), (0.9989, False), (0.0, False)):
        assert is_flyable(VehicleState(q_wb=Quat(*(scale * number for number in half)))) == verdict


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_fault_of_a_sensor_is_seen(sign):
    assert not is_faulty(NO_SENSOR_FAULT)
    assert is_faulty(NO_SENSOR_FAULT._replace(frozen=True))
    assert is_faulty(NO_SENSOR_FAULT._replace(yaw_offset=0.1 * sign))
    for axis in "xyz":
        assert is_faulty(NO_SENSOR_FAULT._replace(offset_w=Vec3()._replace(**{axis: 0.1 * sign})))
