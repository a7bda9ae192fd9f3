"""The functions that make a state: each keeps what it does not name, in CPython and compiled."""

import pytest

from quad_core.compilation import compiled
from quad_core.types import Quat, Vec3, VehicleState, fresh, with_ages, with_ground

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
