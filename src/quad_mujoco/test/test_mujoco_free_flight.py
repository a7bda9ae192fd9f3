"""rigid_body and MuJoCo, written by different people, under the same random wrench: same flight, same order."""

import math
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_core.parameters import build
from quad_core.types import Conditions, Vec3, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics import rigid_body
from quad_mujoco import plant as mujoco_plant

# asymmetric, and strong enough that no rotor limit is met
VEHICLE = Vehicle(
    inertia_xx=3e-3,
    inertia_yy=4e-3,
    inertia_zz=6e-3,
    drag_coefficient=0.05,
    drag_torque_coefficient=0.0,
    thrust_to_weight=10.0,
)
HOLD = 0.02
DURATION = 10.0


def histories(seed=1):
    rng = np.random.default_rng(seed)
    weight = VEHICLE.mass * VEHICLE.gravity
    for _ in range(round(DURATION / HOLD)):
        torque = Vec3(*(rng.normal(size=3) * (2e-2, 2e-2, 1e-2)).tolist())
        force = Vec3(*(0.5 * rng.normal(size=3)).tolist())
        yield Wrench(weight * (1.0 + 0.1 * rng.normal()), torque), Conditions(force_w=force)


def flown(plant, step, vehicle=VEHICLE):
    parameters = build(plant.Parameters, {})
    state = plant.init(parameters, vehicle)
    for wrench, conditions in histories():
        for _ in range(round(HOLD / step)):
            state, actuation = plant.step(parameters, vehicle, state, wrench, conditions, step)
            assert not any(actuation[-5:])
    return plant.observe(parameters, vehicle, state)


def difference(a, b):
    turned = Rotation.from_quat(a.q_wb).inv() * Rotation.from_quat(b.q_wb)
    return math.dist(a.p_w, b.p_w), turned.magnitude()


def test_ten_seconds_of_random_wrench_end_in_the_same_place_and_attitude():
    position, angle = difference(flown(rigid_body, 2e-3), flown(mujoco_plant, 2e-3))
    assert position < 1e-6
    assert angle < 1e-6


def test_the_difference_shrinks_with_the_fourth_order_of_the_step():
    errors = [difference(flown(rigid_body, step), flown(mujoco_plant, step)) for step in (2e-2, 1e-2, 5e-3)]
    for coarse, fine in pairwise(errors):
        for kind in range(2):
            assert 3.5 < math.log2(coarse[kind] / fine[kind]) < 5.5


def test_the_drag_torque_held_over_a_step_is_a_difference_of_first_order():
    vehicle = VEHICLE._replace(drag_torque_coefficient=5.6e-4)
    coarse, fine = (difference(flown(rigid_body, h, vehicle), flown(mujoco_plant, h, vehicle)) for h in (4e-3, 2e-3))
    for kind in range(2):
        assert 0.8 < math.log2(coarse[kind] / fine[kind]) < 1.2


def test_printed_drag_is_refused_by_name():
    with pytest.raises(ValueError, match="drag_sign"):
        mujoco_plant.init(build(mujoco_plant.Parameters, {"drag_sign": "printed"}), VEHICLE)


def test_nothing_is_kept_between_two_steps():
    parameters = build(mujoco_plant.Parameters, {"initial.omega.x": 3.0, "initial.p.z": 2.0})
    state = mujoco_plant.init(parameters, VEHICLE)
    wrench, conditions = next(histories())
    once = mujoco_plant.step(parameters, VEHICLE, state, wrench, conditions, 2e-3)
    mujoco_plant.step(parameters, VEHICLE, once[0], Wrench(50.0, Vec3(1.0, 1.0, 1.0)), Conditions(), 2e-3)
    assert mujoco_plant.step(parameters, VEHICLE, state, wrench, conditions, 2e-3) == once


def test_flights_in_threads_are_those_flown_alone():
    vehicles = [VEHICLE, VEHICLE._replace(thrust_to_weight=9.0)]  # one body to MuJoCo
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(partial(flown, mujoco_plant, 1e-2), vehicles))
    assert together == [flown(mujoco_plant, 1e-2, vehicle) for vehicle in vehicles]
