"""The guard's backup law in closed loop with the plant: from anywhere in the envelope to the ground."""

import math
import random

import pytest
from guard_flights import descent, draw_start, on_ground, vehicle_named

from quad_core.guard_parameters import GuardParameters
from quad_core.types import CALM
from quad_dynamics.parameters import PlantParameters
from quad_guard import guard

pytestmark = pytest.mark.unit
VEHICLES = ("paper", "x500", "crazyflie21")
TOUCHDOWN_SPEED = 1.5
TOUCHDOWN_TILT = math.radians(15.0)
LONGEST = 30_000


@pytest.mark.parametrize("name", VEHICLES)
def test_it_lands_softly_from_anywhere_in_the_envelope(name):
    vehicle, rng = vehicle_named(name), random.Random(7)
    for _ in range(4):
        start = draw_start(rng, vehicle, (3.5, 6.0))
        ending = descent(GuardParameters(), PlantParameters(), vehicle, start, LONGEST, 0, 0, CALM)
        assert ending.touched, start
        assert ending.finite
        assert ending.speed < TOUCHDOWN_SPEED, start
        assert ending.tilt < TOUCHDOWN_TILT, start
        assert ending.mode == guard.DESCEND


@pytest.mark.parametrize("name", VEHICLES)
def test_with_a_ground_it_comes_to_rest_and_stops_the_motors_there(name):
    vehicle, rng = vehicle_named(name), random.Random(8)
    start = draw_start(rng, vehicle, (1.5, 2.0), tilt=10.0, speed=0.5, rate=0.2)
    ending = descent(GuardParameters(), on_ground(PlantParameters()), vehicle, start, LONGEST, 0, 0, CALM)
    assert ending.stopped
    assert ending.height < 0.12
    assert ending.tilt < math.radians(2.0)


@pytest.mark.parametrize("name", VEHICLES)
def test_a_state_that_stays_away_for_0_4_s_is_bridged(name):
    vehicle, rng = vehicle_named(name), random.Random(10)
    for begin in (1, 100, 400):
        start = draw_start(rng, vehicle, (5.0, 7.0))
        ending = descent(GuardParameters(), PlantParameters(), vehicle, start, LONGEST, begin, begin + 200, CALM)
        assert ending.touched
        assert ending.mode == guard.DESCEND
        assert ending.speed < TOUCHDOWN_SPEED
        assert ending.tilt < TOUCHDOWN_TILT


@pytest.mark.parametrize("mass_share", [-0.3, 0.3])
def test_a_wrong_mass_is_borne(mass_share):
    for name in VEHICLES:
        vehicle, rng = vehicle_named(name), random.Random(9)
        if vehicle.thrust_to_weight / (1.0 + mass_share) < 1.5:
            continue  # x500 with 30 % more mass has too little thrust left to stop 5 m/s in 6 m
        plant = PlantParameters(mass_error=mass_share * vehicle.mass)
        ending = descent(GuardParameters(), plant, vehicle, draw_start(rng, vehicle, (6.0, 8.0)), LONGEST, 0, 0, CALM)
        assert ending.touched
        assert ending.speed < TOUCHDOWN_SPEED
        assert ending.tilt < TOUCHDOWN_TILT
