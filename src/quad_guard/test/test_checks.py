"""What a wrench and a state must be: each rule of docs/explanation/safety.md by itself."""

import math

import pytest
from guard_cases import DT, HOVER, PERIOD, VEHICLE, Owner, flying
from hypothesis import given
from hypothesis import strategies as st

from quad_core.enumerations import CommandRefusal, GuardMode, GuardReason, StateRefusal
from quad_core.geometry import normalized
from quad_core.node_parameters import CommandLimits, StateLimits, StepLimits
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Layout, Vehicle
from quad_guard import checks
from quad_guard.checks import WrenchCommand
from quad_guard.state import COARSEST_GRAIN, finer

BAD = (math.nan, math.inf, -math.inf)


def refusal(wrench=HOVER, step=100, now=100, last=99):
    command = checks.WrenchCommand(wrench, step, True)
    return checks.command_refusal(CommandLimits(), VEHICLE, command, last, now, PERIOD)  # now: the newest state's step


def state_refusal(state, step=101, last=None, last_step=100, now=101):
    sample = checks.StateSample(state, step, True)
    last = flying() if last is None else last
    return checks.sample_refusal(StateLimits(), sample, last, last_step, last, last_step, now, PERIOD, False)


@pytest.mark.parametrize("value", BAD)
@pytest.mark.parametrize("place", range(4))
def test_no_field_of_a_command_may_be_other_than_finite(place, value):
    numbers = [5.0, 0.0, 0.0, 0.0]
    numbers[place] = value
    assert refusal(Wrench(numbers[0], Vec3(*numbers[1:]))) == CommandRefusal.NOT_FINITE


@pytest.mark.parametrize(("step", "expected"), [
    *((100 + ahead, CommandRefusal.AHEAD) for ahead in (2**62, 1)),
    *((100 - age, CommandRefusal.ACCEPTED) for age in (0, 30, 50)),
    *((100 - age, CommandRefusal.TOO_OLD) for age in (51, 75)),
    *((step, CommandRefusal.NOT_NEWER) for step in (0, -1, -100)),
])  # fmt: skip
def test_a_command_is_newer_than_the_last_at_most_100_ms_old_and_answers_a_published_state(step, expected):
    assert refusal(step=step, now=100, last=0) == expected


def test_a_sample_ahead_of_the_vehicle_s_time_permits_no_command_ahead_of_it():
    owner = Owner()
    owner.run(0.1)
    ahead = owner.step + 9
    sample = owner.good_sample()._replace(step=ahead)
    owner.once(WrenchCommand(HOVER, ahead, True), sample)
    assert owner.refusals[0] == CommandRefusal.AHEAD


@pytest.mark.parametrize(("wrench", "expected"), [
    *((Wrench(thrust, Vec3()), CommandRefusal.THRUST) for thrust in (1e6, -1e6, 2.01 * 3.0 * 0.56 * 9.8)),
    *((Wrench(5.0, Vec3(**{axis: 1e6})), CommandRefusal.TORQUE) for axis in "xyz"),
])  # fmt: skip
def test_thrust_and_torque_are_those_of_the_vehicle(wrench, expected):
    assert refusal(wrench) == expected


def test_the_largest_torque_is_that_of_the_rotors():
    # one rotor at 3/4 m g pushes at 0.3 m; yaw: two rotors and 3.8e-2 / 4.2e-3 m
    assert checks.largest_torque(Vehicle()) == pytest.approx((1.2348, 1.2348, 74.48), rel=1e-12)
    # two rotors at 0.3 sqrt(1/2) m
    assert checks.largest_torque(Vehicle(layout=Layout.X)).x == pytest.approx(2.0 * 4.116 * 0.3 * math.sqrt(0.5))


@given(st.floats(-100.0, 100.0), *(st.floats(-1.2, 1.2) for _ in range(3)))
def test_what_the_rotors_could_make_is_never_refused_for_its_size(thrust, x, y, z):
    expected = CommandRefusal.THRUST if abs(thrust) > 2.0 * 3.0 * 0.56 * 9.8 else CommandRefusal.ACCEPTED
    assert refusal(Wrench(thrust, Vec3(x, y, z))) == expected


def every_field_broken(value):
    for name, kind in (("p_w", Vec3), ("v_w", Vec3), ("q_wb", Quat), ("omega_b", Vec3)):
        for field in kind._fields:
            yield flying(x=DT)._replace(**{name: getattr(flying(x=DT), name)._replace(**{field: value})})


@pytest.mark.parametrize("value", [*BAD, 1e308, -1e308])
def test_no_field_of_a_sample_may_be_other_than_finite_and_bounded(value):
    for state in every_field_broken(value):
        assert state_refusal(state) == StateRefusal.NOT_FINITE


@pytest.mark.parametrize(("scale", "expected"), [(0.0, 1), (0.5, 1), (2.0, 1), (1.0 + 4e-4, 0), (-1.0, 0)])
def test_a_quaternion_has_length_one_and_its_negative_is_the_same_attitude(scale, expected):
    q = Quat(*(scale * part for part in flying(roll=0.3).q_wb))
    assert state_refusal(flying(x=DT)._replace(q_wb=q), last=flying(roll=0.3)) == expected


@pytest.mark.parametrize(
    ("step", "expected"), [(100, StateRefusal.NOT_NEWER), (101 + 251, StateRefusal.AHEAD), (2**63, StateRefusal.AHEAD)]
)
def test_a_sample_is_newer_and_not_ahead(step, expected):
    assert state_refusal(flying(x=DT), step=step) == expected


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(
    ("off", "expected"), [(0.99, 0), (1.01, StateRefusal.POSITION_JUMP), (4.0, StateRefusal.POSITION_JUMP)]
)
def test_a_position_may_be_a_metre_from_where_the_last_velocity_led(axis, off, expected):
    last = flying()._replace(v_w=Vec3(1.0, 2.0, -3.0))
    for step, gap in ((101, DT), (300, 0.4)):
        p = [0.0 + gap, 0.0 + 2.0 * gap, 5.0 - 3.0 * gap]
        p[axis] += off
        seen = flying()._replace(p_w=Vec3(*p), v_w=Vec3(-9.0, 9.0, 9.0))
        assert state_refusal(seen, step=step, last=last, now=step) == expected


@pytest.mark.parametrize(
    ("degrees", "expected"), [(19.9, 0), (20.1, StateRefusal.ATTITUDE_JUMP), (180.0, StateRefusal.ATTITUDE_JUMP)]
)
def test_an_attitude_may_turn_by_20_degrees(degrees, expected):
    assert state_refusal(flying(x=DT, roll=math.radians(degrees))) == expected


@given(st.floats(0.01, 3.2), st.floats(-1.1, 1.1))
def test_what_is_surely_within_an_angle_is_within_it_and_little_is_left_open(angle, share):
    first, second = flying().q_wb, flying(roll=share * angle).q_wb
    surely, change = checks.is_surely_within(first, second, angle), checks.attitude_change(first, second)
    assert change <= angle if surely else change > 0.6 * angle


def test_a_vehicle_that_turns_may_turn_farther_in_a_gap():
    turning = flying(rates=(3.0, 0.0, 0.0))
    assert state_refusal(flying(x=0.2, roll=0.6), step=200, now=200, last=turning) == StateRefusal.ACCEPTED
    assert state_refusal(flying(x=0.2, roll=0.6), step=200, now=200) == StateRefusal.ATTITUDE_JUMP


def resting(height, speed=0.0, rate=0.0):
    return VehicleState(Vec3(0.0, 0.0, height), Vec3(0.0, 0.0, speed), Quat(0.0, 0.0, 0.0, 1.0), Vec3(rate, 0.0, 0.0))


def repeated(seen, wrench=lambda _: HOVER, seconds=0.3, grain=1e-12):
    """Return the guard's owner after ``seen`` was repeated under ``wrench(k)``; the first sample is a ``grain`` off."""
    owner = Owner()
    first = seen._replace(
        **{name: Vec3(*(x + grain for x in getattr(seen, name))) for name in ("p_w", "v_w", "omega_b")}
    )
    first = first._replace(q_wb=normalized(Quat(grain, grain, grain, 1.0 - grain)))
    owner.once(owner.good_command(wrench(0)), owner.sample(first))
    owner.run(seconds, lambda it: it.good_command(wrench(it.step)), lambda it: it.sample(seen))
    return owner


@pytest.mark.parametrize(
    ("speed", "rate", "after"), [(1e-3, 0.0, 1), (0.0, 1e-3, 1), (-3.0, 0.0, 1), (2e-8, 0.0, 25), (0.0, 2e-8, 25)]
)
def test_a_state_that_repeats_itself_although_the_vehicle_moves_is_frozen(speed, rate, after):
    """It is frozen once it would have moved by 1e-9: ``after`` steps of 2 ms."""
    owner = repeated(resting(2.0, speed, rate))
    assert owner.events == [(after + 51, GuardMode.DESCEND, GuardReason.STATE_LOST)]
    assert owner.refusals[1] == StateRefusal.FROZEN


def test_a_hover_that_has_come_to_rest_to_the_last_bit_may_repeat_itself():
    assert repeated(resting(2.0)).events == []
    assert repeated(resting(2.0), lambda k: HOVER._replace(thrust=HOVER.thrust + 1e-12 * k)).events == []


@pytest.mark.parametrize(
    "change", [Wrench(1e-5, Vec3()), Wrench(-0.1, Vec3()), Wrench(0.0, Vec3(1e-6, 0.0, 0.0)), Wrench(0.0, Vec3(z=1e-5))]
)
def test_a_state_at_rest_that_does_not_follow_a_changed_wrench_is_frozen(change):
    def wrench(k):
        torque = Vec3(*(a + b for a, b in zip(HOVER.torque_b, change.torque_b, strict=True)))
        return HOVER if k < 100 else Wrench(HOVER.thrust + change.thrust, torque)

    # the wrench of step 100 is flown until 101
    owner = repeated(resting(2.0), wrench, 0.4)
    assert owner.events == [(100 + 51, GuardMode.DESCEND, GuardReason.STATE_LOST)]


@pytest.mark.parametrize(("speed", "grain", "after"), [(0.0, 0.01, 0), (0.01, 0.01, 0), (0.1, 0.01, 100)])
def test_an_estimate_in_coarse_steps_is_frozen_when_it_should_have_taken_two(speed, grain, after):
    """At 0.1 m/s two steps of 0.01 m take 100 of 2 ms; a thrust that creeps by less than that shows nothing."""
    owner = repeated(resting(2.0, speed), lambda k: HOVER._replace(thrust=HOVER.thrust + 1e-5 * k), 0.5, grain)
    assert owner.events == ([(after + 51, GuardMode.DESCEND, GuardReason.STATE_LOST)] if after else [])


def test_a_coarse_estimate_that_does_not_follow_the_thrust_is_frozen():
    """10 % more thrust is 0.02 m/s after 11 steps of 2 ms."""
    owner = repeated(
        resting(2.0), lambda k: HOVER._replace(thrust=(1.1 if k >= 100 else 1.0) * HOVER.thrust), 0.5, 0.01
    )
    assert owner.events == [(100 + 11 + 50, GuardMode.DESCEND, GuardReason.STATE_LOST)]


def test_a_number_that_stays_the_same_does_not_tell_its_grain():
    state = flying()
    assert finer(COARSEST_GRAIN, state, state) == COARSEST_GRAIN


def test_a_vehicle_that_stands_on_the_ground_may_repeat_itself():
    def share(most):
        return lambda k: Wrench(min(0.002 * k, most) * HOVER.thrust, Vec3(0.0, 0.0, 0.0))

    assert repeated(resting(0.1, 0.01, 0.01), share(0.5)).events == []
    assert repeated(resting(0.1), share(1.0), 1.5).events == []
    # on the ground it neither moves fast nor has it more thrust than its weight
    assert repeated(resting(0.1, 0.2), share(0.5)).events
    assert repeated(resting(0.1), share(1.01), 1.5).events
    assert repeated(resting(0.1, 0.01)._replace(ground_z=-1.0), share(0.5)).events


@pytest.mark.parametrize("steps", [2, 10, 40])
def test_a_sensor_slower_than_the_plant_may_repeat_itself(steps):
    owner = Owner()
    held = []

    def slow(it):
        if it.step % steps == 0:
            held[:] = [it.good_sample().state]
        return it.sample(held[0])

    owner.run(1.0, sample=slow)
    assert owner.events == []


HOP = StepLimits(math.radians(10.0), 0.5, 1.0, 0.8, 1.2)
ANYWHERE = StateLimits(position_jump=100.0)


def at(p=(0.0, 0.0, 0.5), v=(0.0, 0.0, 0.0), roll=0.0):
    """Return what gives a sample of a vehicle there; its gyro shows that it lives."""

    def sample(owner):
        here = flying(roll=math.radians(roll), rates=(1e-4 * owner.step, 0.0, 0.0))
        return owner.sample(here._replace(p_w=Vec3(*p), v_w=Vec3(*v)))

    return sample


@pytest.mark.parametrize(("sample", "reason"), [
    (at(p=(0.99, -0.99, 0.99)), None),
    (at(p=(1.01, 0.0, 0.5)), GuardReason.STEP_BOX),
    (at(p=(0.0, -1.01, 0.5)), GuardReason.STEP_BOX),
    (at(p=(0.0, 0.0, 1.01)), GuardReason.STEP_BOX),
    (at(v=(0.3, 0.3, 0.2)), None),
    (at(v=(0.3, 0.3, 0.3)), GuardReason.STEP_SPEED),
    (at(roll=9.9), None),
    (at(roll=-10.1), GuardReason.STEP_TILT),
])  # fmt: skip
def test_beyond_a_limit_of_the_step_the_guard_flies_at_once(sample, reason):
    owner = Owner(step=HOP, state=ANYWHERE)
    owner.once(sample=at()(owner))
    owner.once(sample=sample(owner))
    assert owner.events == ([(1, GuardMode.DESCEND, reason)] if reason else [])
    free = Owner(state=ANYWHERE)
    free.once(sample=at()(free))
    free.once(sample=sample(free))
    assert free.events == []


@pytest.mark.parametrize(
    ("height", "sink", "is_broken"), [(0.5, 2.2, False), (0.5, 2.3, True), (0.05, 0.9, False), (0.05, 1.1, True)]
)
def test_it_sinks_no_faster_than_can_be_braked_before_the_ground(height, sink, is_broken):
    sample = at(p=(0.0, 0.0, height), v=(0.0, 0.0, -sink))
    owner, free = Owner(step=StepLimits(speed=5.0), state=ANYWHERE), Owner(state=ANYWHERE)
    owner.once(sample=sample(owner))
    free.once(sample=sample(free))
    assert owner.events == ([(0, GuardMode.DESCEND, GuardReason.STEP_SPEED)] if is_broken else [])
    assert free.events == []


def test_the_box_is_about_the_place_of_take_off():
    owner = Owner(step=HOP, state=ANYWHERE)
    owner.run(0.02, sample=at(p=(40.0, -7.0, 0.5)))
    owner.run(0.02, sample=at(p=(40.9, -7.9, 0.5)))
    assert owner.events == []
    owner.once(sample=at(p=(39.05, -8.02, 0.5))(owner))
    assert owner.events == [(20, GuardMode.DESCEND, GuardReason.STEP_BOX)]


@pytest.mark.parametrize(
    ("height", "asked", "flown"),
    [(0.5, 2.0, 1.2), (0.5, 1.1, 1.1), (0.5, 0.1, 0.8), (0.2, 0.1, 0.1), (0.2, 2.0, 1.2), (0.2, -0.5, 0.0)],
)
def test_a_thrust_beyond_the_range_is_cut_and_the_torque_stays(height, asked, flown):
    owner, torque = Owner(step=HOP, state=ANYWHERE), Vec3(0.01, -0.02, 0.03)
    owner.once(owner.good_command(Wrench(asked * HOVER.thrust, torque)), at(p=(0.0, 0.0, height))(owner))
    assert owner.wrench.torque_b == torque
    assert owner.wrench.thrust == pytest.approx(flown * HOVER.thrust)
