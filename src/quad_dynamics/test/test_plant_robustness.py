"""From any flyable state under any finite wrench a plant raises nothing: divergence is for the caller to see."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_cases import numbers, starting, under

from quad_core.cycle import is_flyable
from quad_core.types import Vec3, Wrench
from quad_core.vehicle import Layout, Vehicle
from quad_dynamics import paper, rigid_body
from quad_dynamics.parameters import PlantParameters

ANY = st.floats(allow_nan=False, allow_infinity=False)
BOUND = st.sampled_from([-1e3, -1.0, 0.0, 0.5, 1e3])
VEHICLE = st.fixed_dictionaries(
    {
        "mass": st.sampled_from([0.001, 1.0, 1000.0]),
        "arm_length": st.sampled_from([0.001, 10.0]),
        "inertia_xx": st.sampled_from([1e-7, 1.0, 100.0]),
        "inertia_yy": st.sampled_from([1e-7, 1.0, 100.0]),
        "inertia_zz": st.sampled_from([1e-7, 1.0, 100.0]),
        "lift_coefficient": st.sampled_from([1e-12, 1.0]),
        "torque_coefficient": st.sampled_from([1e-14, 1.0]),
        "drag_coefficient": st.sampled_from([0.0, 100.0]),
        "drag_torque_coefficient": st.sampled_from([0.0, 100.0]),
        "thrust_to_weight": st.sampled_from([1.05, 20.0]),
        "layout": st.sampled_from([Layout.PLUS, Layout.X]),
    }
).map(lambda fields: Vehicle(**fields))
START = st.builds(
    starting,
    v=st.tuples(BOUND, BOUND, BOUND),
    angles=st.sampled_from([-1.5, 0.0, 1.5]).map(lambda theta: (0.3, theta, 3.1)),
    omega=st.tuples(BOUND, BOUND, BOUND),
)
PARAMETERS = st.tuples(st.sampled_from([1, 2, 20]), st.sampled_from([0, 1]), START).map(
    lambda parts: PlantParameters(substeps=parts[0], drag_sign=parts[1], initial=parts[2])
)


@pytest.mark.parametrize("plant", [rigid_body, paper])
@settings(max_examples=200, deadline=None)
@given(vehicle=VEHICLE, parameters=PARAMETERS, wrench=st.tuples(*[ANY] * 4), dt=st.sampled_from([1e-4, 0.002, 0.1]))
def test_nothing_is_raised_before_the_check_can_see_it(plant, vehicle, parameters, wrench, dt):
    command = Wrench(wrench[0], Vec3(*wrench[1:]))
    force, torque = Vec3(5.0, -5.0, 5.0), Vec3(0.1, 0.1, -0.1)
    state = plant.init(parameters, vehicle)
    for _ in range(5):
        lumped = plant.lumped(parameters, vehicle, state, command, under(force, torque))
        assert all(abs(number) < float("inf") for number in numbers(lumped))
        state, actuation = plant.step(parameters, vehicle, state, command, under(force, torque), dt)
        assert all(abs(number) < float("inf") for number in numbers(actuation))
        if not is_flyable(plant.observe(parameters, vehicle, state)):
            return
