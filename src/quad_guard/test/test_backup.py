"""The backup law by itself: signs, limits, and when motors may stop."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quad_core.geometry import quaternion_from_euler
from quad_core.node_parameters import ContactRule
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_guard.backup import Descent, Known, Sight, descend, predict
from quad_guard.unknown_torque import NO_UNKNOWN_TORQUE, UnknownTorque

RULE, VEHICLE = ContactRule(), Vehicle()
WEIGHT = 0.56 * 9.8
FRESH = Descent()
UPRIGHT = Quat(0.0, 0.0, 0.0, 1.0)
NONE = Vec3(0.0, 0.0, 0.0)


def state(height=5.0, v=(0.0, 0.0, 0.0), angles=(0.0, 0.0, 0.0), omega=(0.0, 0.0, 0.0)):
    return VehicleState(Vec3(0.0, 0.0, height), Vec3(*v), quaternion_from_euler(Vec3(*angles)), Vec3(*omega))


def wrench(sight=Sight.SEES, memory=FRESH, vehicle=VEHICLE, known=(), **changes):
    seen = state(**changes)
    known = Known(sight, 0.31, NO_UNKNOWN_TORQUE, 1.0, WEIGHT)._replace(**dict(known))
    return descend(RULE, vehicle, memory, seen, seen.p_w.z, known, 0.002)[0]


@pytest.mark.parametrize(
    ("angles", "sign"), [((0.3, 0.0, 0.0), (-1, 0)), ((0.0, 0.3, 0.0), (0, -1)), ((-3.0, 0.0, 0.0), (1, 0))]
)
def test_the_torque_turns_back_to_level(angles, sign):
    torque = wrench(Sight.TURNS, angles=angles).torque_b
    assert (round(torque.x, 9) > 0) - (round(torque.x, 9) < 0) == sign[0]
    assert (round(torque.y, 9) > 0) - (round(torque.y, 9) < 0) == sign[1]


def test_the_torque_is_the_stated_one():
    # J w^2 sin(0.3) and J 2 D w p with J = 3.5e-3, w = 8, D = 0.9; yaw: J_zz 3 r
    assert wrench(Sight.TURNS, angles=(0.3, 0.0, 0.0)).torque_b.x == pytest.approx(-3.5e-3 * 64.0 * math.sin(0.3))
    assert wrench(Sight.TURNS, omega=(1.0, 0.0, 0.0)).torque_b.x == pytest.approx(-3.5e-3 * 14.4)
    assert wrench(Sight.TURNS, omega=(0.0, 0.0, 1.0)).torque_b.z == pytest.approx(-7e-3 * 3.0)


@pytest.mark.parametrize("sight", range(4))
def test_an_unknown_torque_is_taken_off_whatever_is_seen(sight):
    assert wrench(sight, known={"unknown": UnknownTorque(torque=Vec3(0.03, -0.02, 0.5))}).torque_b == pytest.approx(
        (-0.03, 0.02, -0.5)
    )


def test_upside_down_it_turns_too():
    assert abs(wrench(Sight.TURNS, angles=(math.pi, 0.0, 0.0)).torque_b.x) > 0.1


def test_it_leans_against_the_velocity_and_sinks_slowly_while_fast():
    fast = wrench(v=(4.0, 0.0, 0.0))
    assert fast.torque_b.y < 0.0  # nose up: backwards
    # a quarter of 0.8 m/s is asked for: 4 (0.2) = 0.8 m/s^2 less than hover
    assert fast.thrust == pytest.approx(0.56 * (9.8 - 0.8))
    assert wrench().thrust == pytest.approx(0.56 * (9.8 - 4.0 * 0.8))
    assert wrench(v=(0.0, 0.0, -0.8)).thrust == pytest.approx(WEIGHT)


def test_without_a_heading_it_stays_level_and_sinks_at_once():
    fast = wrench(Sight.NO_HEADING, v=(4.0, 2.0, 0.0))
    assert fast.torque_b == NONE
    assert fast.thrust == pytest.approx(0.56 * (9.8 - 4.0 * 0.8))


def test_without_velocity_it_thrusts_a_little_less_than_the_weight():
    assert wrench(Sight.TURNS, v=(3.0, 3.0, -9.0)).thrust == pytest.approx(0.94 * WEIGHT)


def braked(height, speed, **changes):
    return wrench(Sight.BLIND, height=0.1 + height, v=(0.0, 0.0, -speed), **changes).thrust


def test_without_any_state_it_falls_and_brakes_in_the_height_that_is_left():
    # it has 0.9 * 3 g - g = 16.66 m/s^2: 0.7 of it stops 8 m/s to 0.8 m/s in (64 - 0.64) / 2 / 11.662 m
    braking = 0.7 * 1.7 * 9.8
    assert braked((64.0 - 0.64) / 2.0 / braking, 8.0) == pytest.approx(0.56 * (9.8 + braking))
    assert braked((64.0 - 0.64) / 2.0 / braking + 1.0, 8.0) == pytest.approx(0.05 * WEIGHT)
    # what gives 5 % less has 0.95 * 0.9 * 3 g - g: a thrust of g and seven tenths of that, over 0.95
    weaker = 0.7 * (0.95 * 2.7 - 1.0) * 9.8
    assert braked((64.0 - 0.64) / 2.0 / weaker, 8.0, known={"strength": 0.95}) == pytest.approx(
        0.56 / 0.95 * (9.8 + weaker)
    )
    # below the height that it aims at it goes on sinking; upside down there is none
    assert braked(-0.05, 0.8) == pytest.approx(WEIGHT)
    assert braked(0.1, 9.0, angles=(3.0, 0.0, 0.0)) == pytest.approx(0.05 * WEIGHT)
    assert wrench(Sight.BLIND, v=(1.0, 0.0, 0.0)).torque_b.y < 0.0  # brakes as it does with a state


@pytest.mark.parametrize(
    ("share", "before", "expected"),
    [(0.039, 1.0, 0.05), (0.041, 1.0, 1.0), (0.041, 0.9, 0.9), (0.041, 2.0, 1.0 / 0.95)],
)
def test_without_any_state_what_is_off_trim_keeps_the_thrust_of_before(share, before, expected):
    # in hover torques of one rotor, 0.25 * weight * 0.3 m; a hover's thrust at most; about z it tilts nothing
    unknown = UnknownTorque(torque=Vec3(0.0, share * 0.25 * WEIGHT * 0.3, 1.0))
    known = {"unknown": unknown, "strength": 0.95, "thrust": before * WEIGHT}
    assert wrench(Sight.BLIND, known=known).thrust == pytest.approx(expected * WEIGHT)


def test_without_any_state_it_waits_for_one_before_it_falls():
    first, late = (wrench(Sight.BLIND, known={"unseen": unseen, "thrust": 0.97 * WEIGHT}) for unseen in (0.29, 0.31))
    assert first.thrust == pytest.approx(0.97 * WEIGHT)
    assert late.thrust == pytest.approx(0.05 * WEIGHT)


@pytest.mark.parametrize("sight", list(Sight))
def test_upside_down_no_thrust_pushes_down_whatever_is_seen(sight):
    found = wrench(sight, angles=(3.0, 0.0, 0.0), known={"unseen": 0.2, "thrust": 0.97 * WEIGHT})
    assert found.thrust <= 0.2 * WEIGHT


def test_a_state_that_returns_late_in_a_fall_is_braked_in_the_height_that_is_left():
    # from 1.5 to 0.8 m/s in 0.2 m: (2.25 - 0.64) / 0.4 m/s^2 beside 4 (1.5 - 0.8)
    late = wrench(height=0.3, v=(0.0, 0.0, -1.5))
    assert late.thrust == pytest.approx(0.56 * (9.8 + 4.025 + 2.8))
    assert wrench(height=0.3, v=(0.0, 0.0, -0.7)).thrust == pytest.approx(0.56 * (9.8 - 0.4))


def test_a_fall_is_braked_to_the_speed_that_it_aims_at():
    height, speed, dt = 5.0, 0.0, 0.002
    while height > 0.0:
        thrust = braked(height - 0.1, speed)
        speed, height = speed + dt * (9.8 - thrust / 0.56), height - dt * speed
    assert speed == pytest.approx(0.8, abs=0.05)


@pytest.mark.parametrize(("unseen", "stops"), [(2.10, False), (2.12, True)])
def test_thrust_ends_when_an_unseen_torque_may_have_turned_the_vehicle_by_85_degrees(unseen, stops):
    # sqrt(2 * 85 deg / (2 / 3 rad/s^2)) = 2.110 s
    assert (wrench(Sight.BLIND, known={"unseen": unseen}) == Wrench(0.0, NONE)) == stops
    assert wrench(Sight.TURNS, known={"unseen": unseen}).thrust > 0.0


@given(
    st.floats(0.0, 20.0),
    st.tuples(*(st.floats(-50.0, 50.0),) * 3),
    st.tuples(*(st.floats(-3.1, 3.1),) * 3),
    st.tuples(*(st.floats(-50.0, 50.0),) * 3),
    st.integers(0, 3),
)
def test_the_wrench_is_always_one_that_the_vehicle_has(height, v, angles, omega, sight):
    found = wrench(sight, height=height, v=v, angles=angles, omega=omega)
    assert 0.05 * WEIGHT * (1 - 1e-12) <= found.thrust <= 0.9 * 3.0 * WEIGHT * (1 + 1e-12)
    assert abs(found.torque_b.x) <= 1.2348001
    assert abs(found.torque_b.y) <= 1.2348001
    assert abs(found.torque_b.z) <= 74.4801


def at_rest(height, seconds, sight=Sight.SEES):
    memory, found = FRESH, []
    for _ in range(round(seconds / 0.002)):
        seen = state(height)
        output, memory = descend(
            RULE, VEHICLE, memory, seen, height, Known(sight, 0.2, NO_UNKNOWN_TORQUE, 1.0, WEIGHT), 0.002
        )
        found.append((output.thrust, memory.stopped))
    return found


def test_on_the_ground_thrust_goes_down_and_the_motors_stop():
    found = at_rest(0.1, 1.2)
    assert not found[240][1]
    assert found[-1] == (0.0, True)
    stopping = next(i for i, (_, stopped) in enumerate(found) if stopped)
    assert stopping * 0.002 == pytest.approx(1.0, abs=0.02)


def test_above_the_stop_height_they_turn_on_whatever_it_lies_on():
    thrust, stopped = at_rest(0.31, 5.0)[-1]
    assert not stopped
    assert 0.0 < thrust < 0.3 * WEIGHT


def test_without_velocity_nothing_is_taken_for_contact():
    assert at_rest(0.1, 3.0, Sight.TURNS)[-1] == (pytest.approx(0.94 * WEIGHT), False)


def test_the_prediction_is_that_of_free_fall_and_of_a_free_spin():
    seen = state(5.0, (1.0, 0.0, 0.0), omega=(0.0, 0.0, 1.0))
    for _ in range(500):
        seen = predict(VEHICLE._replace(drag_coefficient=0.0), seen, Wrench(0.0, Vec3(0.0, 0.0, 0.0)), False, 0.001)
    assert seen.v_w == pytest.approx((1.0, 0.0, -4.9))
    assert seen.p_w == pytest.approx((0.5, 0.0, 5.0 - 1.225), abs=3e-3)
    assert 2.0 * math.atan2(seen.q_wb.z, seen.q_wb.w) == pytest.approx(0.5, abs=1e-6)


def test_the_prediction_knows_the_drag():
    # k_F v / m: 0.3 / 0.56 of each velocity in m/s
    seen = predict(VEHICLE._replace(drag_coefficient=0.3), state(v=(2.0, -1.0, -4.0)), Wrench(), False, 0.01)
    expected = (2.0 - 0.01 * 0.3 / 0.56 * 2.0, -1.0 + 0.01 * 0.3 / 0.56, -4.0 + 0.01 * (0.3 / 0.56 * 4.0 - 9.8))
    assert seen.v_w == pytest.approx(expected)


def test_the_prediction_follows_the_torque_unless_the_rate_is_measured():
    torque = Wrench(WEIGHT, Vec3(3.5e-3, 0.0, 0.0))
    assert predict(VEHICLE, state(), torque, False, 0.01).omega_b.x == pytest.approx(0.01)
    assert predict(VEHICLE, state(), torque, True, 0.01).omega_b.x == 0.0


UNEVEN = Vehicle(inertia_xx=2e-3, inertia_yy=3e-3, inertia_zz=7e-3)


def test_the_prediction_turns_as_eulers_equations_say():
    seen = predict(UNEVEN, state(omega=(1.0, 2.0, 3.0)), Wrench(WEIGHT, Vec3(0.0, 0.0, 0.0)), False, 0.001)
    # (3 - 7) 2 3 / 2, (7 - 2) 1 3 / 3, (2 - 3) 1 2 / 7
    assert seen.omega_b == pytest.approx((1.0 - 0.012, 2.0 + 0.005, 3.0 - 0.002 / 7.0))


def test_the_torque_carries_the_gyroscopic_part():
    torque = wrench(Sight.TURNS, vehicle=UNEVEN, omega=(1.0, 2.0, 3.0)).torque_b
    damping = 2.0 * 0.9 * 8.0
    assert torque.x == pytest.approx(-2e-3 * damping * 1.0 + (7e-3 - 3e-3) * 2.0 * 3.0)
    assert torque.y == pytest.approx(-3e-3 * damping * 2.0 + (2e-3 - 7e-3) * 1.0 * 3.0)
    assert torque.z == pytest.approx(-7e-3 * 3.0 * 3.0 + (3e-3 - 2e-3) * 1.0 * 2.0)
