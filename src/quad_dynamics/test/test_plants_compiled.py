"""The compiled text gives the bits of the interpreted one, rotors saturated or not, and the same verdict at the end."""

import numpy as np
import pytest
from plant_cases import ASYMMETRIC, WRONG, flat, vector

from quad_core.compilation import compiled
from quad_core.cycle import is_flyable
from quad_core.types import CALM, Conditions, Rotors, Vec3, Wrench
from quad_core.vehicle import DragSign, Layout
from quad_dynamics import paper, rigid_body
from quad_dynamics.parameters import Ground, PlantParameters

STEPS = 10_000


def bits(value):
    return flat(value).tobytes()


@pytest.mark.parametrize("plant", [rigid_body, paper])
def test_divergence_ends_at_the_same_step(plant):
    step, observe, flyable = compiled(plant.step), compiled(plant.observe), compiled(is_flyable)
    vehicle = ASYMMETRIC._replace(inertia_xx=1e-6, drag_torque_coefficient=5.0, drag_coefficient=50.0)
    parameters = PlantParameters(substeps=3, drag_sign=DragSign.PRINTED)
    here = there = plant.init(parameters, vehicle)
    wrench = Wrench(20.0, Vec3(5.0, 5.0, 5.0))
    for _ in range(3000):
        here, _ = plant.step(parameters, vehicle, here, wrench, CALM, 0.002)
        there, _ = step(parameters, vehicle, there, wrench, CALM, 0.002)
        verdict = is_flyable(plant.observe(parameters, vehicle, here))
        assert verdict == flyable(observe(parameters, vehicle, there))
        if not verdict:
            return
    pytest.fail("expected a divergence")


def test_random_steps_with_everything_on_are_bit_equal():
    step, lumped = compiled(rigid_body.step), compiled(rigid_body.lumped)
    vehicle = ASYMMETRIC._replace(
        layout=Layout.X, rotor_time_constant=0.03, rotor_speed_min=50.0, rotor_inertia=1e-4, rotor_drag_coefficient=5e-5
    )
    parameters = WRONG._replace(substeps=2, ground=Ground(enabled=True, height=-0.2))
    rng = np.random.default_rng(12)
    here = there = start = rigid_body.init(parameters, vehicle)
    assert bits(compiled(rigid_body.init)(parameters, vehicle)) == bits(start)
    for k in range(3000):
        conditions = Conditions(
            vector(rng, 2.0),
            vector(rng, 0.1),
            vector(rng, 6.0),
            0.2 if k % 3 else 0.0,
            Rotors(*rng.uniform(0.0, 1.0, 4).tolist()),
            float(rng.uniform(0.5, 1.0)),
        )
        wrench = Wrench(float(rng.uniform(0.0, 40.0)), vector(rng, 0.3))
        here, actuation = rigid_body.step(parameters, vehicle, here, wrench, conditions, 0.002)
        there, other = step(parameters, vehicle, there, wrench, conditions, 0.002)
        assert bits((here, actuation)) == bits((there, other)), k
        if k % 10 == 0:
            mine = rigid_body.lumped(parameters, vehicle, here, wrench, conditions)
            assert bits(mine) == bits(lumped(parameters, vehicle, there, wrench, conditions))
        if not is_flyable(rigid_body.observe(parameters, vehicle, here)) or k % 300 == 299:
            here = there = start
