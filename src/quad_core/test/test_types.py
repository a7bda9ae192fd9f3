"""The functions on the records: a state keeps what they do not name, in CPython and compiled; a fault is seen."""

import pytest
from scipy.spatial.transform import Rotation

from quad_core.compilation import compiled
from quad_core.types import (
    NO_SENSOR_FAULT,
    Quat,
    SensorFault,
    Vec3,
    VehicleState,
    fresh,
    is_faulty,
    misread,
    with_ages,
    with_ground,
)

PARTS = (Vec3(1.0, 2.0, 3.0), Vec3(4.0, 5.0, 6.0), Quat(0.1, 0.2, 0.3, 0.9), Vec3(7.0, 8.0, 9.0))
STATE = VehicleState(*PARTS, 0.1, 0.2, 0.3, 0.4, 13.0, True)
MADE = {
    fresh: (PARTS, VehicleState(*PARTS)),
    with_ages: ((STATE, 1.0, 2.0, 3.0, 4.0), VehicleState(*PARTS, 1.0, 2.0, 3.0, 4.0, 13.0, True)),
    with_ground: ((STATE, -5.0, False), VehicleState(*PARTS, 0.1, 0.2, 0.3, 0.4, -5.0, False)),
}


@pytest.mark.parametrize("function", MADE, ids=lambda function: function.__name__)
@pytest.mark.parametrize("engine", [lambda function: function, compiled], ids=["python", "compiled"])
def test_each_function_changes_what_it_names_alone(engine, function):
    arguments, expected = MADE[function]
    assert engine(function)(*arguments) == expected


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_fault_of_a_sensor_is_seen(sign):
    assert not is_faulty(NO_SENSOR_FAULT)
    assert is_faulty(NO_SENSOR_FAULT._replace(frozen=True))
    assert is_faulty(NO_SENSOR_FAULT._replace(yaw_offset=0.1 * sign))
    for axis in "xyz":
        assert is_faulty(NO_SENSOR_FAULT._replace(offset_w=Vec3()._replace(**{axis: 0.1 * sign})))


def test_a_jump_shifts_the_position_and_turns_the_heading():
    tilted = Rotation.from_euler("ZYX", [1.0, 0.4, -0.3])
    state = STATE._replace(q_wb=Quat(*map(float, tilted.as_quat())))
    reading = misread(state, SensorFault(offset_w=Vec3(1.0, 2.0, -3.0), yaw_offset=0.4))
    assert reading.p_w == (2.0, 4.0, 0.0)
    expected = Rotation.from_euler("Z", 0.4) * tilted
    assert (expected.inv() * Rotation.from_quat(reading.q_wb)).magnitude() < 1e-14
    assert reading._replace(p_w=state.p_w, q_wb=state.q_wb) == state._replace(ground_z=0.0, on_ground=False)
