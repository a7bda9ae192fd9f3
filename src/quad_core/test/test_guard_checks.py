"""What a wrench and a state must be: each rule of docs/explanation/safety.md by itself."""

import math

import pytest
from guard_cases import DT, HOVER, PERIOD, VEHICLE, Owner, flying
from hypothesis import given
from hypothesis import strategies as st

from quad_core import guard_checks as checks
from quad_core.guard_parameters import CommandLimits, StateLimits
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Layout, Vehicle

BAD = (math.nan, math.inf, -math.inf)


def refusal(wrench=HOVER, step=100, stamp=None, accepted=True, now=100, last=99):
    command = checks.WrenchCommand(wrench, step, step * PERIOD if stamp is None else stamp, True, accepted)
    return checks.command_refusal(CommandLimits(), VEHICLE, command, last, now, PERIOD)


def state_refusal(state, step=101, stamp=None, accepted=True, last=None, last_step=100, now=101):
    sample = checks.StateSample(state, step, step * PERIOD if stamp is None else stamp, True, accepted)
    last = flying() if last is None else last
    return checks.sample_refusal(StateLimits(), sample, last, last_step, now, PERIOD)


def test_a_good_command_is_accepted():
    assert refusal() == checks.ACCEPTED


@pytest.mark.parametrize("value", BAD)
@pytest.mark.parametrize("place", range(4))
def test_no_field_of_a_command_may_be_other_than_finite(place, value):
    numbers = [5.0, 0.0, 0.0, 0.0]
    numbers[place] = value
    assert refusal(Wrench(numbers[0], Vec3(*numbers[1:]))) == checks.NOT_FINITE


def test_a_command_of_a_stranger_is_refused():
    assert refusal(accepted=False) == checks.FOREIGN


@pytest.mark.parametrize("step", [99, 98, 0])
def test_a_command_must_be_newer_than_the_last(step):
    assert refusal(step=step, last=99) == checks.NOT_NEWER


@pytest.mark.parametrize(("ahead", "expected"), [(10, checks.ACCEPTED), (11, checks.AHEAD), (2**62, checks.AHEAD)])
def test_a_command_may_be_20_ms_ahead(ahead, expected):
    assert refusal(step=100 + ahead) == expected


@pytest.mark.parametrize(("age", "expected"), [(30, 0), (50, 0), (51, checks.TOO_OLD), (75, checks.TOO_OLD)])
def test_a_command_may_be_100_ms_old(age, expected):
    assert refusal(step=1000 - age, now=1000, last=900) == expected


@pytest.mark.parametrize("error", [1, -1, PERIOD])
def test_the_stamp_of_a_command_is_step_times_period(error):
    assert refusal(stamp=100 * PERIOD + error) == checks.STAMP


@pytest.mark.parametrize("thrust", [1e6, -1e6, 2.01 * 3.0 * 0.56 * 9.8])
def test_thrust_is_that_of_the_vehicle(thrust):
    assert refusal(Wrench(thrust, Vec3(0.0, 0.0, 0.0))) == checks.THRUST


@pytest.mark.parametrize("axis", range(3))
def test_torque_is_that_of_the_vehicle(axis):
    torque = [0.0, 0.0, 0.0]
    torque[axis] = 1e6
    assert refusal(Wrench(5.0, Vec3(*torque))) == checks.TORQUE


def test_the_largest_torque_is_that_of_the_rotors():
    # one rotor at 3/4 m g pushes at 0.3 m; yaw: two rotors and 3.8e-2 / 4.2e-3 m
    assert checks.largest_torque(Vehicle()) == pytest.approx((1.2348, 1.2348, 74.48), rel=1e-12)
    # two rotors at 0.3 sqrt(1/2) m
    assert checks.largest_torque(Vehicle(layout=Layout.X)).x == pytest.approx(2.0 * 4.116 * 0.3 * math.sqrt(0.5))


@given(st.floats(-100.0, 100.0), *(st.floats(-1.2, 1.2) for _ in range(3)))
def test_what_the_rotors_could_make_is_never_refused_for_its_size(thrust, x, y, z):
    expected = checks.THRUST if abs(thrust) > 2.0 * 3.0 * 0.56 * 9.8 else checks.ACCEPTED
    assert refusal(Wrench(thrust, Vec3(x, y, z))) == expected


def test_a_good_sample_is_accepted():
    assert state_refusal(flying(x=DT)) == checks.ACCEPTED


def every_field_broken(value):
    for name, kind in (("p_w", Vec3), ("v_w", Vec3), ("q_wb", Quat), ("omega_b", Vec3)):
        for field in kind._fields:
            yield flying(x=DT)._replace(**{name: getattr(flying(x=DT), name)._replace(**{field: value})})


@pytest.mark.parametrize("value", [*BAD, 1e308, -1e308])
def test_no_field_of_a_sample_may_be_other_than_finite_and_bounded(value):
    for state in every_field_broken(value):
        assert state_refusal(state) == checks.NOT_FINITE


@pytest.mark.parametrize(("scale", "expected"), [(0.0, 1), (0.5, 1), (2.0, 1), (1.0 + 4e-4, 0), (-1.0, 0)])
def test_a_quaternion_has_length_one_and_its_negative_is_the_same_attitude(scale, expected):
    q = Quat(*(scale * part for part in flying(roll=0.3).q_wb))
    assert state_refusal(flying(x=DT)._replace(q_wb=q), last=flying(roll=0.3)) == expected


@pytest.mark.parametrize(("accepted", "step", "stamp", "expected"), [
    (False, 101, None, checks.FOREIGN),
    (True, 100, None, checks.NOT_NEWER),
    (True, 101 + 251, None, checks.AHEAD),
    (True, 2**63, None, checks.AHEAD),
    (True, 101, 101 * PERIOD + 1, checks.STAMP),
])  # fmt: skip
def test_a_sample_has_sender_step_and_stamp(accepted, step, stamp, expected):
    assert state_refusal(flying(x=DT), step=step, stamp=stamp, accepted=accepted) == expected


@pytest.mark.parametrize(("x", "expected"), [(0.99, 0), (1.01, checks.POSITION_JUMP), (4.0, checks.POSITION_JUMP)])
def test_a_position_may_be_a_metre_from_where_the_last_one_led(x, expected):
    assert state_refusal(flying(x=x + DT)) == expected
    # after a gap of 0.4 s the vehicle may be 0.4 m farther
    assert state_refusal(flying(x=x + 0.4), step=300, now=300) == expected


@pytest.mark.parametrize(("degrees", "expected"), [(19.9, 0), (20.1, checks.ATTITUDE_JUMP), (180.0, 8)])
def test_an_attitude_may_turn_by_20_degrees(degrees, expected):
    assert state_refusal(flying(x=DT, roll=math.radians(degrees))) == expected


@given(st.floats(0.01, 3.2), st.floats(-1.1, 1.1))
def test_what_is_surely_within_an_angle_is_within_it_and_little_is_left_open(angle, share):
    first, second = flying().q_wb, flying(roll=share * angle).q_wb
    surely, change = checks.is_surely_within(first, second, angle), checks.attitude_change(first, second)
    assert change <= angle if surely else change > 0.6 * angle


def test_a_vehicle_that_turns_may_turn_farther_in_a_gap():
    turning = flying(rates=(3.0, 0.0, 0.0))
    assert state_refusal(flying(x=0.2, roll=0.6), step=200, now=200, last=turning) == checks.ACCEPTED
    assert state_refusal(flying(x=0.2, roll=0.6), step=200, now=200) == checks.ATTITUDE_JUMP


def test_a_sample_that_moves_but_repeats_itself_is_frozen():
    assert state_refusal(flying()) == checks.FROZEN
    assert state_refusal(flying(x=1e-12)) == checks.ACCEPTED


def test_a_vehicle_at_rest_may_repeat_itself_without_noise_only():
    rest = VehicleState(Vec3(0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0))
    assert state_refusal(rest, last=rest) == checks.ACCEPTED
    sample = checks.StateSample(rest, 101, 101 * PERIOD, True, True)
    noisy = StateLimits(frozen_motion=0.0)
    assert checks.sample_refusal(noisy, sample, rest, 100, 101, PERIOD) == checks.FROZEN


def test_each_refusal_has_its_words():
    assert len(set(checks.COMMAND_REFUSALS)) == 9
    assert len(checks.STATE_REFUSALS) == 10


def test_a_refused_command_is_counted_named_and_does_not_reach_the_rotors():
    owner = Owner()
    owner.run(0.1)
    report = owner.once(command=owner.good_command(Wrench(math.nan, Vec3(0.0, 0.0, 0.0))))
    assert owner.wrench == HOVER
    assert (report.mode, report.command_refusal, report.refused_commands) == (0, checks.NOT_FINITE, 1)
