"""Each rotor's place, spin and torque (errata of Eq. 8); the allocation is exact within the limits, never beyond them.

Under its priorities it is the best by linear programming.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_cases import ASYMMETRIC, allocate
from scipy.optimize import linprog

from quad_core.types import Rotors, Vec3, Wrench
from quad_core.vehicle import Layout, Vehicle
from quad_dynamics.rotors import rotor_limit, wrench_from_rotors

D = ASYMMETRIC.arm_length
S = D / math.sqrt(2.0)
PLACES = {
    Layout.PLUS: {"rear": (-D, 0, 0), "right": (0, -D, 0), "front": (D, 0, 0), "left": (0, D, 0)},
    Layout.X: {"rear right": (-S, -S, 0), "front right": (S, -S, 0), "front left": (S, S, 0), "rear left": (-S, S, 0)},
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
    made = wrench_from_rotors(ASYMMETRIC._replace(layout=layout), Rotors(*thrusts))
    lever = np.cross(place, [0.0, 0.0, 2.0])
    drag = YAW[index] * ASYMMETRIC.torque_coefficient / ASYMMETRIC.lift_coefficient * 2.0
    assert made.thrust == 2.0
    np.testing.assert_allclose(made.torque_b, [lever[0], lever[1], drag], rtol=1e-14, atol=1e-16)


LAYOUTS = (Layout.PLUS, Layout.X)
VEHICLES = [vehicle._replace(layout=layout) for vehicle in (ASYMMETRIC, Vehicle()) for layout in LAYOUTS]
ANY = st.floats(allow_nan=False, allow_infinity=False)
SHARE = st.floats(0.0, 1.0)


def effect(vehicle):
    """Rows thrust, roll, pitch, yaw per newton of each rotor, from places and spins."""
    d, s = vehicle.arm_length, vehicle.arm_length * np.sqrt(0.5)
    plus = [(-d, 0), (0, -d), (d, 0), (0, d)]
    x = [(-s, -s), (s, -s), (s, s), (-s, s)]
    places = np.array(x if vehicle.layout == Layout.X else plus)
    yaw = vehicle.torque_coefficient / vehicle.lift_coefficient
    return np.array([np.ones(4), places[:, 1], -places[:, 0], yaw * np.array([1, -1, 1, -1])])


def scales(vehicle):
    """Sizes of thrust, roll, pitch and yaw that the rotors can make."""
    limit = rotor_limit(vehicle)
    arm = vehicle.arm_length
    return np.array([4, arm, arm, 2 * vehicle.torque_coefficient / vehicle.lift_coefficient]) * limit


def achieved(actuation):
    return np.array([actuation.thrust, *actuation.torque_b])


def flags(actuation):
    return tuple(actuation[4:])


def test_rotors_that_never_stand_still_carry_no_more_than_is_asked_for():
    vehicle = ASYMMETRIC._replace(rotor_speed_min=5.0)
    assert allocate(vehicle, Wrench(12.0, Vec3(0.0, 0.0, 0.0))).thrust == pytest.approx(12.0, rel=1e-14)


@pytest.mark.parametrize("vehicle", VEHICLES)
@settings(deadline=None)
@given(shares=st.tuples(SHARE, SHARE, SHARE, SHARE))
def test_a_wrench_that_rotors_can_make_is_made_exactly_and_unflagged(vehicle, shares):
    limit = rotor_limit(vehicle)
    thrusts = Rotors(*(limit * share for share in shares))
    command = wrench_from_rotors(vehicle, thrusts)
    actuation = allocate(vehicle, command)
    assert flags(actuation) == (False,) * 5
    np.testing.assert_allclose(actuation.rotor_thrust, thrusts, atol=4e-15 * 4 * limit)
    np.testing.assert_allclose(
        achieved(actuation) / scales(vehicle), [command.thrust, *command.torque_b] / scales(vehicle), atol=1e-14
    )


@pytest.mark.parametrize("vehicle", VEHICLES)
@settings(deadline=None)
@given(numbers=st.tuples(ANY, ANY, ANY, ANY))
def test_any_finite_wrench_gives_rotors_within_limits(vehicle, numbers):
    actuation = allocate(vehicle, Wrench(numbers[0], Vec3(*numbers[1:])))
    limit = rotor_limit(vehicle)
    assert all(0.0 <= thrust <= limit for thrust in actuation.rotor_thrust)
    np.testing.assert_allclose(
        np.square(actuation.rotor_speed) * vehicle.lift_coefficient, actuation.rotor_thrust, rtol=1e-14
    )
    np.testing.assert_allclose(
        achieved(actuation) / scales(vehicle), effect(vehicle) @ actuation.rotor_thrust / scales(vehicle), atol=1e-14
    )


@pytest.mark.parametrize("vehicle", VEHICLES)
@settings(deadline=None)
@given(numbers=st.tuples(*[st.floats(-3.0, 3.0)] * 4))
def test_nothing_is_made_over_or_against_what_was_asked_and_flags_say_what_missed(vehicle, numbers):
    asked = np.array(numbers) * scales(vehicle)
    actuation = allocate(vehicle, Wrench(float(asked[0]), Vec3(*asked[1:].tolist())))
    made, size = achieved(actuation), scales(vehicle)
    for axis in (1, 2, 3):
        low, high = sorted((0.0, asked[axis]))
        assert low - 1e-12 * size[axis] <= made[axis] <= high + 1e-12 * size[axis]
    # the axis of the tilting torque stays
    assert abs(made[1] * asked[2] - made[2] * asked[1]) <= 1e-12 * size[1] * size[2]
    miss = made - asked
    expected = (miss[0] < 0, miss[0] > 0, miss[1] != 0, miss[2] != 0, miss[3] != 0)
    clear = np.abs(miss[[0, 0, 1, 2, 3]]) / size[[0, 0, 1, 2, 3]]
    for flag, want, far in zip(flags(actuation), expected, clear, strict=True):
        if far > 1e-8:
            assert flag == want
        if far < 1e-11:
            assert not flag


def best(vehicle, asked):
    """Lexicographic optimum: share of tilting torque, then thrust, then yaw, yaw between none and what was asked."""
    rows, limit = effect(vehicle), rotor_limit(vehicle)
    rows, asked = rows * limit / scales(vehicle)[:, None], asked / scales(vehicle)
    low, high = sorted((0.0, asked[3]))
    yaw = np.array([rows[3], -rows[3]])
    # unknowns: four rotor thrusts over the limit, then the share or the distance
    first = linprog(
        [0, 0, 0, 0, -1],
        A_ub=np.hstack([yaw, np.zeros((2, 1))]),
        b_ub=[high, -low],
        A_eq=np.hstack([rows[1:3], -asked[1:3, None]]),
        b_eq=[0, 0],
        bounds=[(0, 1)] * 5,
    )
    tilt = rows[1:3], first.x[4] * asked[1:3]
    thrust = nearest(rows[0], asked[0], tilt, yaw, (high, -low))
    fixed = np.vstack([tilt[0], rows[0]]), np.append(tilt[1], thrust)
    turn = nearest(rows[3], asked[3], fixed, yaw, (high, -low))
    return np.array([thrust, *tilt[1], turn]) * scales(vehicle)


def nearest(row, command, equal, yaw, yaw_limits):
    distance = -np.ones((2, 1))
    found = linprog(
        [0, 0, 0, 0, 1],
        A_ub=np.vstack([np.hstack([np.array([row, -row]), distance]), np.hstack([yaw, np.zeros((2, 1))])]),
        b_ub=[command, -command, yaw_limits[0] + 1e-9, yaw_limits[1] + 1e-9],
        A_eq=np.hstack([equal[0], np.zeros((len(equal[0]), 1))]),
        b_eq=equal[1],
        bounds=[(0, 1)] * 4 + [(0, None)],
    )
    assert found.status == 0, found.message
    return float(row @ found.x[:4])


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_result_is_the_lexicographic_optimum_of_linear_programming(vehicle):
    rng = np.random.default_rng(20)
    for _ in range(40):
        asked = rng.uniform([-0.2, -1.5, -1.5, -1.5], [1.3, 1.5, 1.5, 1.5]) * scales(vehicle)
        made = achieved(allocate(vehicle, Wrench(float(asked[0]), Vec3(*asked[1:].tolist()))))
        np.testing.assert_allclose(made / scales(vehicle), best(vehicle, asked) / scales(vehicle), atol=1e-6)


def test_yaw_gives_way_before_thrust_and_thrust_before_tilt():
    vehicle = ASYMMETRIC._replace(layout=Layout.PLUS)
    limit = rotor_limit(vehicle)
    yaw_arm = vehicle.torque_coefficient / vehicle.lift_coefficient
    only_yaw = allocate(
        vehicle, Wrench(2.0 * limit, Vec3(0.5 * limit * vehicle.arm_length, 0.0, 4.0 * limit * yaw_arm))
    )
    assert flags(only_yaw) == (False, False, False, False, True)
    raised = allocate(vehicle, Wrench(0.0, Vec3(0.0, 0.5 * limit * vehicle.arm_length, 0.0)))
    assert flags(raised) == (False, True, False, False, False)
    # F1 - F3 = limit / 2 and no yaw: each pair carries limit / 2
    assert raised.thrust == pytest.approx(limit, rel=1e-12)
    lowered = allocate(vehicle, Wrench(4.0 * limit, Vec3(limit * vehicle.arm_length, 0.0, 0.0)))
    assert flags(lowered) == (True, False, False, False, False)
    assert lowered.thrust == pytest.approx(2.0 * limit, rel=1e-12)
    tumbling = allocate(
        vehicle, Wrench(0.0, Vec3(3.0 * limit * vehicle.arm_length, 1.5 * limit * vehicle.arm_length, 0.0))
    )
    assert flags(tumbling) == (False, True, True, True, False)
    np.testing.assert_allclose(tumbling.torque_b[:2], [limit * vehicle.arm_length, 0.5 * limit * vehicle.arm_length])
