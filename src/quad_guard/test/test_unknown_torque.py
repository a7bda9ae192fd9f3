"""The observer of unknown torque, and what torque may cost in thrust."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quad_core.types import Vec3, Wrench
from quad_core.vehicle import Layout, Vehicle
from quad_guard.unknown_torque import (
    NO_UNKNOWN_TORQUE,
    advanced,
    estimated,
    is_of_one_rotor,
    thrust_for,
    torque_at,
    within_thrust,
)

PLUS = Vehicle(inertia_xx=2e-3, inertia_yy=3e-3, inertia_zz=7e-3)
X = PLUS._replace(layout=Layout.X.value, rotor_speed_min=2.0)
WEIGHT = 0.56 * 9.8
DT = 0.002


def watched(vehicle, commanded, true, seconds, sees=True, memory=None):
    """Let a body turn about x and y under ``true`` N m while ``commanded`` N m is believed."""
    memory, omega = memory or NO_UNKNOWN_TORQUE, Vec3(0.0, 0.0, 0.0)
    for k in range(round(seconds / DT)):
        memory = estimated(vehicle, memory, omega, sees and k > 0)
        memory = advanced(vehicle, memory, omega, Wrench(WEIGHT, commanded), DT)
        p, q, r = omega
        # torque less omega x J omega, of moments 2, 3, 7
        turning = Vec3((3e-3 - 7e-3) * q * r, (7e-3 - 2e-3) * p * r, (2e-3 - 3e-3) * p * q)
        omega = Vec3(
            p + DT * (true.x + turning.x) / 2e-3,
            q + DT * (true.y + turning.y) / 3e-3,
            r + DT * (true.z + turning.z) / 7e-3,
        )
    return memory


def test_what_the_command_explains_is_no_unknown_torque():
    found = watched(PLUS, Vec3(0.01, 0.0, 0.0), Vec3(0.01, 0.0, 0.0), 1.0)
    assert found.torque == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_half_a_rotor_is_found_to_63_per_cent_after_the_time_constant_of_the_observer():
    # -0.25 weight * 0.3 m / 2 about x
    half = Vec3(-0.125 * WEIGHT * 0.3, 0.0, 0.0)
    found = watched(PLUS, Vec3(0.0, 0.0, 0.0), half, 1.0 / 15.0)
    assert found.torque.x == pytest.approx((1.0 - math.exp(-1.0)) * half.x, rel=0.03)
    assert watched(PLUS, Vec3(0.0, 0.0, 0.0), half, 1.0).torque.x == pytest.approx(half.x, rel=1e-3)


def test_a_load_a_millimetre_off_the_centre_is_found_too():
    small = Vec3(0.0, 1e-3 * WEIGHT, 0.0)
    assert watched(PLUS, Vec3(0.0, 0.0, 0.0), small, 2.0).torque.y == pytest.approx(small.y, rel=1e-3)


def test_what_no_rotor_makes_is_not_believed():
    # one rotor at 3/4 m g pushes at 0.3 m
    assert watched(PLUS, Vec3(9.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), 1.0).made.x == pytest.approx(0.75 * WEIGHT * 0.3)
    assert watched(PLUS, Vec3(0.0, 0.0, 0.0), Vec3(-9.0, 0.0, 0.0), 1.0).torque.x == pytest.approx(-0.75 * WEIGHT * 0.3)


def test_it_stays_as_it_is_while_nothing_is_seen_and_goes_on_without_a_jump():
    half = Vec3(-0.125 * WEIGHT * 0.3, 0.0, 0.0)
    known = watched(PLUS, Vec3(0.0, 0.0, 0.0), half, 1.0)
    blind = watched(PLUS, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), 1.0, sees=False, memory=known)
    assert blind.torque == known.torque
    again = estimated(PLUS, blind, Vec3(0.0, 0.0, 0.0), True)
    assert again.torque.x == pytest.approx(half.x, rel=0.05)


# N m of 1 N less at one rotor, and per N the yaw torque of Table 1
YAW = 3.8e-2 / 4.2e-3
ARM = 0.3 * math.sqrt(0.5)
WEAK = {
    PLUS: [Vec3(0.0, -0.3, -YAW), Vec3(0.3, 0.0, YAW), Vec3(0.0, 0.3, -YAW), Vec3(-0.3, 0.0, YAW)],
    X: [Vec3(ARM, -ARM, -YAW), Vec3(ARM, ARM, YAW), Vec3(-ARM, ARM, -YAW), Vec3(-ARM, -ARM, YAW)],
}


@pytest.mark.parametrize("vehicle", [PLUS, X])
@pytest.mark.parametrize("rotor", range(4))
def test_a_weak_rotor_is_told_from_a_load_by_its_yaw_and_goes_with_the_thrust(vehicle, rotor):
    weak = Vec3(*(0.01 * part for part in WEAK[vehicle][rotor]))
    assert is_of_one_rotor(vehicle, weak)
    assert is_of_one_rotor(vehicle, Vec3(weak.x + 0.2 * weak.y, weak.y - 0.2 * weak.x, 1.2 * weak.z))
    assert not is_of_one_rotor(vehicle, weak._replace(z=0.0))
    assert not is_of_one_rotor(vehicle, weak._replace(z=-weak.z))
    assert not is_of_one_rotor(vehicle, Vec3(weak.x + 0.5 * weak.y, weak.y - 0.5 * weak.x, weak.z))
    for true, share in ((weak, 0.5), (weak._replace(z=0.0), 1.0)):
        known = watched(vehicle, Vec3(0.0, 0.0, 0.0), true, 0.6)
        assert torque_at(vehicle, known, 0.5 * WEIGHT) == pytest.approx(
            [share * part for part in true], rel=0.01, abs=1e-9
        )


def test_the_thrust_of_a_torque_is_that_of_when_it_was_seen():
    weak = Vec3(*(0.01 * part for part in WEAK[X][0]))
    known = watched(X, Vec3(0.0, 0.0, 0.0), weak, 0.6)
    memory = known
    for _ in range(100):
        memory = advanced(X, estimated(X, memory, Vec3(), False), Vec3(), Wrench(2.0 * WEIGHT, Vec3()), DT)
    assert memory.of_thrust == known.of_thrust == pytest.approx(WEIGHT, rel=0.01)
    assert torque_at(X, memory, WEIGHT).x == pytest.approx(weak.x, rel=0.01)


def test_a_spinning_body_is_explained_by_eulers_equations():
    omega, memory = Vec3(1.0, 2.0, 3.0), NO_UNKNOWN_TORQUE
    for k in range(500):
        memory = advanced(PLUS, estimated(PLUS, memory, omega, k > 0), omega, Wrench(), 1e-4)
        p, q, r = omega
        # xx = 2, yy = 3, zz = 7
        omega = Vec3(p + 1e-4 * (3 - 7) / 2 * q * r, q + 1e-4 * (7 - 2) / 3 * p * r, r + 1e-4 * (2 - 3) / 7 * p * q)
    assert memory.torque == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_the_thrust_that_a_torque_costs_is_that_of_its_pairs():
    # plus: F4 - F2 = 0.3 N and F1 - F3 = 0.6 N; each pair carries 0.6 N
    assert thrust_for(PLUS, Vec3(0.09, -0.18, 5.0)) == pytest.approx(1.2)
    # x: (pitch + roll) and (pitch - roll) times sqrt(1/2) / 0.3
    assert thrust_for(X, Vec3(0.09, -0.18, 5.0)) == pytest.approx(2.0 * math.sqrt(0.5) * 0.27 / 0.3)


@pytest.mark.parametrize("vehicle", [PLUS, X])
@given(st.floats(0.0, 15.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_torque_costs_no_more_than_the_thrust_asked_for_or_seven_tenths_of_the_weight(vehicle, thrust, roll, pitch):
    bounded = within_thrust(vehicle, thrust, Vec3(roll, pitch, 0.5))
    idle = 4.0 * 4.2e-3 * vehicle.rotor_speed_min**2
    allowed = max(thrust, 0.7 * WEIGHT) - idle
    cost = thrust_for(vehicle, bounded)
    assert cost <= allowed * (1.0 + 1e-12)
    assert bounded.z == 0.5
    # its axis stays, and what was within is not touched
    assert bounded.x * pitch == pytest.approx(bounded.y * roll, abs=1e-12)
    if thrust_for(vehicle, Vec3(roll, pitch, 0.0)) <= min(allowed, 1.5 * WEIGHT - 0.5 * idle):
        assert bounded == (roll, pitch, 0.5)
