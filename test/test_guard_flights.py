"""The guard's backup law in closed loop with the plant: from anywhere in the envelope to the ground."""

import math
import random

import pytest
from guard_flights import STATE_LOST, Fault, Setup, descent, draw_start, vehicle_named

from quad_core.enumerations import GuardMode
from quad_core.types import CALM, Rotors
from quad_dynamics.parameters import Ground, PlantParameters

pytestmark = pytest.mark.unit
VEHICLES = ("paper", "x500", "crazyflie21")
LONGEST = 30_000
CLIMB = 0.3  # m from 1 m/s upward at most
GENTLE = {"tilt": 10.0, "speed": 1.0, "rate": 0.2}


def assert_lands_softly(ending):
    assert (ending.touched, ending.finite, ending.mode) == (True, True, GuardMode.DESCEND)
    assert ending.speed < 1.5
    assert ending.tilt < math.radians(15.0)


@pytest.mark.parametrize("name", VEHICLES)
def test_it_lands_softly_from_anywhere_in_the_envelope(name):
    vehicle, rng = vehicle_named(name), random.Random(7)
    for _ in range(2):
        assert_lands_softly(descent(Setup(vehicle), draw_start(rng, vehicle, (3.5, 6.0)), LONGEST))


@pytest.mark.parametrize("name", VEHICLES)
def test_with_a_ground_it_comes_to_rest_and_stops_the_motors_there(name):
    vehicle, rng = vehicle_named(name), random.Random(8)
    start = draw_start(rng, vehicle, (1.5, 2.0), tilt=10.0, speed=0.5, rate=0.2)
    plant = PlantParameters(ground=Ground(True, 0.0, 0.1, 0.8))
    ending = descent(Setup(vehicle, plant=plant), start, LONGEST)
    assert ending.stopped
    assert ending.height < 0.12
    assert ending.tilt < math.radians(2.0)


@pytest.mark.parametrize(("name", "begin"), zip((*VEHICLES, "x500"), (1, 100, 400, 0), strict=True))
def test_a_state_that_stays_away_for_0_4_s_is_bridged(name, begin):
    vehicle = vehicle_named(name)
    start = draw_start(random.Random(begin), vehicle, (5.0, 7.0))
    assert_lands_softly(descent(Setup(vehicle), start, LONGEST, Fault(STATE_LOST, begin, begin + 200)))


@pytest.mark.parametrize("mass_share", [-0.3, 0.3])
def test_a_wrong_mass_is_borne(mass_share):
    for name in VEHICLES:
        vehicle, rng = vehicle_named(name), random.Random(9)
        if vehicle.thrust_to_weight / (1.0 + mass_share) < 1.5:
            continue  # x500 with 30 % more mass has too little thrust left to stop 5 m/s in 6 m
        plant = PlantParameters(mass_error=mass_share * vehicle.mass)
        assert_lands_softly(descent(Setup(vehicle, plant=plant), draw_start(rng, vehicle, (6.0, 8.0)), LONGEST))


def rotor_losses(name, working):
    """Yield descents from 6 to 8 m with one rotor that gives ``working`` of its thrust, two rotors for each vehicle."""
    vehicle, rng = vehicle_named(name), random.Random(3)
    for number in range(VEHICLES.index(name), VEHICLES.index(name) + 2):
        left = [1.0] * 4
        left[number] = working
        conditions = CALM._replace(rotor_effectiveness=Rotors(*left))
        yield descent(Setup(vehicle, conditions=conditions), draw_start(rng, vehicle, (6.0, 8.0), **GENTLE), LONGEST)


@pytest.mark.parametrize(("name", "working"), zip(VEHICLES, (0.5, 0.8, 0.5), strict=True))
def test_with_half_a_rotor_it_lands_softly(name, working):
    for ending in rotor_losses(name, working):
        assert_lands_softly(ending)
        assert ending.climb < CLIMB


@pytest.mark.parametrize("name", VEHICLES)
def test_without_a_rotor_it_comes_down_and_never_climbs(name):
    for ending in rotor_losses(name, 0.0):
        assert ending.touched
        assert ending.finite
        assert ending.climb < CLIMB
