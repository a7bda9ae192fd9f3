"""The ground: standing, landing on an edge, no adhesion, sliding, and taking off again."""

import numpy as np
import pytest
from plant_cases import ASYMMETRIC, NONE, flat, starting

from quad_core.types import CALM, Conditions, Vec3, Wrench
from quad_core.vehicle import Layout
from quad_dynamics import paper, rigid_body
from quad_dynamics.parameters import Ground, PlantParameters

GROUND = Ground(enabled=True, height=-2.0, foot_depth=0.12, friction=0.5)
IDLE = Wrench(0.0, NONE)
WEIGHT = ASYMMETRIC.mass * ASYMMETRIC.gravity


def run(initial, seconds, wrench=IDLE, conditions=CALM, ground=GROUND, vehicle=ASYMMETRIC):
    parameters = PlantParameters(ground=ground, initial=initial)
    state, history = rigid_body.init(parameters, vehicle), []
    for _ in range(round(seconds / 0.002)):
        state, _ = rigid_body.step(parameters, vehicle, state, wrench, conditions, 0.002)
        history.append(flat(state))
    return np.array(history)


@pytest.mark.parametrize("layout", [0, Layout.X])
def test_a_dropped_vehicle_comes_to_rest_level_a_millimetre_in(layout):
    start = starting((1.0, 2.0, -1.75), angles=(0.2, -0.15, 0.5))
    end = run(start, 3.0, vehicle=ASYMMETRIC._replace(layout=layout))[-1]
    assert end[2] == pytest.approx(-2.0 + 0.12 - 0.001, abs=2e-5)
    assert np.abs(end[3:6]).max() < 1e-6
    assert np.abs(end[10:13]).max() < 1e-5
    assert np.abs(end[6:8]).max() < 1e-5
    assert abs(end[0] - 1.0) < 0.05


def test_standing_is_rest_and_the_feet_carry_the_weight():
    history = run(starting((0.0, 0.0, -2.0 + 0.12 - 0.001)), 1.0)
    assert np.ptp(history[:, :3], axis=0).max() < 1e-9
    half = run(starting((0.0, 0.0, -1.881)), 2.0, wrench=Wrench(0.5 * WEIGHT, NONE))[-1]
    assert half[2] == pytest.approx(-2.0 + 0.12 - 0.0005, abs=1e-5)


def test_the_ground_does_not_hold_what_lifts_off():
    history = run(starting((0.0, 0.0, -1.881)), 1.0, wrench=Wrench(1.5 * WEIGHT, NONE))
    free = ASYMMETRIC.drag_coefficient / ASYMMETRIC.mass
    t = 1.0
    climb = 0.5 * ASYMMETRIC.gravity / free * (t - (1.0 - np.exp(-free * t)) / free)
    # the feet's springs hand back the 1 mm that they were pressed: a kick of a few cm/s
    assert climb < history[-1, 2] + 1.881 < climb + 0.05


def test_sliding_slows_down_by_friction():
    history = run(starting((0.0, 0.0, -1.881), (3.0, 0.0, 0.0)), 0.2)
    slowing = (history[20, 3] - history[70, 3]) / 0.1
    # friction and drag; the smooth law gives v / (v + 0.1) of friction, and the vehicle pitches a little
    assert slowing == pytest.approx(0.5 * ASYMMETRIC.gravity + 0.37 * 2.6 / 1.3, rel=0.1)


def test_wind_weaker_than_friction_makes_it_creep_only():
    pushed = Conditions(force_w=Vec3(0.1 * WEIGHT, 0.0, 0.0))
    history = run(starting((0.0, 0.0, -1.881)), 2.0, conditions=pushed)
    assert 0.0 < history[-1, 3] < 0.05


def test_above_the_reach_of_the_feet_the_ground_is_not_felt():
    high = starting((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    with_ground = run(high, 0.2)
    without = run(high, 0.2, ground=Ground())
    assert np.array_equal(with_ground, without)


def test_on_the_ground_rotors_start_at_their_least_speed():
    vehicle = ASYMMETRIC._replace(rotor_time_constant=0.03, rotor_speed_min=40.0)
    parameters = PlantParameters(ground=GROUND, initial=starting((0.0, 0.0, -1.881)))
    assert rigid_body.init(parameters, vehicle).rotor_speed == (40.0, 40.0, 40.0, 40.0)


def test_plant_paper_refuses_a_ground():
    with pytest.raises(ValueError, match=r"ground\.enabled"):
        paper.init(PlantParameters(ground=GROUND), ASYMMETRIC)
