"""Compiled by Numba, the very text gives the same bits."""

import random

import pytest

from quad_core.compilation import compiled
from quad_core.geometry import quaternion_from_euler
from quad_core.types import Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory import case1, case2, hover, lemniscate, waypoints

pytest.importorskip("numba")

VEHICLE = Vehicle()


def random_state(rng):
    p, v, angles = (Vec3(*(rng.uniform(-b, b) for _ in range(3))) for b in (100.0, 5.0, 0.5))
    return VehicleState(p, v, quaternion_from_euler(angles), Vec3(0.0, 0.0, 0.0))


@pytest.mark.parametrize("module", [case1, case2, hover, lemniscate])
def test_ten_thousand_samples_have_the_same_bits(module):
    rng = random.Random(5)
    sample, duration = compiled(module.sample), compiled(module.duration)
    for _ in range(20):
        parameters = module.Parameters()
        start = random_state(rng)
        path = module.plan(parameters, VEHICLE, start)
        assert duration(parameters, path) == module.duration(parameters, path)
        for _ in range(500):
            time = rng.uniform(0.0, 120.0)
            assert sample(parameters, path, time) == module.sample(parameters, path, time)


def test_waypoints_have_the_same_bits():
    parameters = waypoints.Parameters(points="0 0 2; 4.25 -1 3 0.5 # turn\n 40 0.125 2.5; -20 5 12 -2")
    start = random_state(random.Random(7))
    path = waypoints.plan(parameters, VEHICLE, start)
    sample = compiled(waypoints.sample)
    for i in range(2000):
        time = path.approach.duration + 1.01 * path.duration * i / 2000
        assert sample(parameters, path, time) == waypoints.sample(parameters, path, time)
