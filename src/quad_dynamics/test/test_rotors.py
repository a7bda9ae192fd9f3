"""Each rotor's place, spin and torque (errata of Eq. 8) and the sums of Eqs. 3 and 8."""

import math

import numpy as np
import pytest
from plant_cases import ASYMMETRIC

from quad_core.types import Rotors
from quad_core.vehicle import Layout
from quad_dynamics import rotors

D = ASYMMETRIC.arm_length
S = D / math.sqrt(2.0)
PLACES = {
    Layout.PLUS: {"rear": (-D, 0, 0), "right": (0, -D, 0), "front": (D, 0, 0), "left": (0, D, 0)},
    Layout.X: {
        "rear right": (-S, -S, 0),
        "front right": (S, -S, 0),
        "front left": (S, S, 0),
        "rear left": (-S, S, 0),
    },
}
YAW = (1.0, -1.0, 1.0, -1.0)
CASES = [
    (layout, index, name, place)
    for layout, places in PLACES.items()
    for index, (name, place) in enumerate(places.items())
]


@pytest.mark.parametrize(("layout", "index", "name", "place"), CASES)
def test_torque_of_each_rotor_is_its_lever_and_its_spin(layout, index, name, place):
    thrusts = [0.0] * 4
    thrusts[index] = 2.0
    made = rotors.wrench_from_rotors(ASYMMETRIC._replace(layout=layout), Rotors(*thrusts))
    lever = np.cross(place, [0.0, 0.0, 2.0])
    drag = YAW[index] * ASYMMETRIC.torque_coefficient / ASYMMETRIC.lift_coefficient * 2.0
    assert made.thrust == 2.0
    np.testing.assert_allclose(made.torque_b, [lever[0], lever[1], drag], rtol=1e-14, atol=1e-16)


def test_lift_at_the_front_pitches_the_nose_up_which_is_negative_about_y():
    made = rotors.wrench_from_rotors(ASYMMETRIC._replace(layout=Layout.PLUS), Rotors(0.0, 0.0, 1.0, 0.0))
    assert made.torque_b.y == -D
    assert made.torque_b.x == 0.0


def test_eq_8_by_hand():
    vehicle = ASYMMETRIC._replace(arm_length=0.5, lift_coefficient=2.0, torque_coefficient=6.0)
    speeds = (1.0, 2.0, 3.0, 4.0)
    thrusts = Rotors(*(rotors.rotor_thrust(vehicle, speed) for speed in speeds))
    assert thrusts == (2.0, 8.0, 18.0, 32.0)
    made = rotors.wrench_from_rotors(vehicle, thrusts)
    # F_T = 60, d (F4 - F2) = 12, d (F1 - F3) = -8, k_M (1 - 4 + 9 - 16) = -60
    assert made == (60.0, (12.0, -8.0, -60.0))
    assert [rotors.rotor_speed(vehicle, thrust) for thrust in thrusts] == pytest.approx(speeds, rel=1e-15)


def test_four_rotors_at_their_limit_give_the_largest_thrust():
    limit = rotors.rotor_limit(ASYMMETRIC)
    made = rotors.wrench_from_rotors(ASYMMETRIC, Rotors(limit, limit, limit, limit))
    assert made.thrust == pytest.approx(3.5 * 1.3 * 9.81, rel=1e-14)
    assert made.torque_b == (0.0, 0.0, 0.0)
