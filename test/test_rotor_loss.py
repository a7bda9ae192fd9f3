"""A descent with a rotor that fails: it never climbs, and lands softly while the other three can bear the vehicle."""

import math
import random

import pytest
from guard_flights import descent, draw_start, vehicle_named

from quad_core.guard_parameters import GuardParameters
from quad_core.types import CALM, Rotors
from quad_dynamics.parameters import PlantParameters
from quad_guard import guard

pytestmark = pytest.mark.unit
VEHICLES = ("paper", "x500", "crazyflie21")
LONGEST = 15_000
CLIMB = 0.3  # m from 1 m/s upward at most


def descents(name, working, count):
    """Yield descents from 6 to 8 m with one rotor that gives ``working`` of its thrust, each in its turn."""
    vehicle, rng = vehicle_named(name), random.Random(3)
    for number in range(count):
        left = [1.0] * 4
        left[number % 4] = working
        start = draw_start(rng, vehicle, (6.0, 8.0), tilt=10.0, speed=1.0, rate=0.2)
        conditions = CALM._replace(rotor_effectiveness=Rotors(*left))
        yield descent(GuardParameters(), PlantParameters(), vehicle, start, LONGEST, 0, 0, conditions)


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("working", [0.8, 0.5])
def test_with_half_a_rotor_it_lands_softly(name, working):
    for ending in descents(name, working, 4):
        assert ending.touched
        assert ending.mode == guard.DESCEND
        assert ending.speed < 1.5
        assert ending.tilt < math.radians(15.0)
        assert ending.climb < CLIMB


@pytest.mark.parametrize("name", VEHICLES)
def test_without_a_rotor_it_comes_down_and_never_climbs(name):
    for ending in descents(name, 0.0, 4):
        assert ending.touched
        assert ending.finite
        assert ending.climb < CLIMB
