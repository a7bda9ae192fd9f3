"""When the guard takes over, why, and how it gives back."""

import math

import pytest
from guard_cases import DT, HOVER, VEHICLE, Owner, flying, leaning, no_state, silent
from hypothesis import given, settings
from hypothesis import strategies as st

from quad_core.enumerations import GuardMode, GuardReason, GuardRequest
from quad_core.geometry import quaternion_from_euler
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_guard.checks import WrenchCommand


@settings(max_examples=200)
@given(
    st.lists(
        st.tuples(
            st.floats(0.0, 16.0), st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(-0.5, 0.5), st.booleans()
        ),
        min_size=1,
        max_size=60,
    ),
    st.floats(-50.0, 50.0),
)
def test_what_is_good_passes_to_the_bit(commands, tilt_degrees):
    owner = Owner()
    last = None
    for thrust, x, y, z, arrives in commands:
        if arrives or last is None:
            last = Wrench(thrust, Vec3(x, y, z))
            command = owner.good_command(last)
        else:
            command = command._replace(arrived=False)
        # a controller of a lower rate: none of its gaps is 20 ms long
        if owner.step - command.step >= 10:
            command = owner.good_command(last)
        report = owner.once(command, owner.good_sample(roll=math.radians(tilt_degrees)))
        assert owner.wrench is last
        assert (report.mode, report.condition, report.warning) == (GuardMode.PASS, GuardReason.GOOD, False)


@pytest.mark.parametrize("period", [1_000_000, 2_000_000, 4_000_000, 5_000_000])
def test_a_silent_controller_is_warned_of_after_20_ms_and_replaced_after_50(period):
    owner = Owner(period=period)
    owner.run(1.0)
    last = owner.step - 1
    warned = None
    while owner.report.mode == GuardMode.PASS:
        owner.once(command=silent(owner))
        if owner.report.warning and warned is None:
            warned = owner.step - 1
    per_ms = 1_000_000 / period
    assert warned == last + math.floor(20 * per_ms) + 1
    assert owner.events == [(last + math.floor(50 * per_ms) + 1, GuardMode.DESCEND, GuardReason.WRENCH_LOST)]


def test_a_wrench_that_answers_the_newest_state_is_not_late_however_old():
    owner = Owner()
    owner.run(1.0)
    last = owner.step - 1
    while owner.report.mode == GuardMode.PASS:
        owner.once(command=silent(owner), sample=no_state(owner))
        assert owner.report.command_age == 0.0
    assert owner.events == [(last + 51, GuardMode.DESCEND, GuardReason.STATE_LOST)]


def test_a_wrench_is_late_from_the_first_state_on_that_it_does_not_answer():
    owner = Owner()
    owner.run(1.0)
    for _ in range(40):  # 80 ms without a state, then states again, and no answer
        owner.once(command=silent(owner), sample=no_state(owner))
    first = owner.step
    owner.run(0.2, command=silent)
    assert owner.events == [(first - 1 + 26, GuardMode.DESCEND, GuardReason.WRENCH_LOST)]


def test_refused_commands_do_not_feed_the_watchdog():
    owner = Owner()
    owner.run(0.5)
    owner.run(0.1, command=lambda it: it.good_command(Wrench(1e6, Vec3(0.0, 0.0, 0.0))))
    assert owner.report.reason == GuardReason.WRENCH_LOST
    assert owner.report.refused_commands == 50


def test_a_silent_state_warns_descends_falls_and_kills():
    owner = Owner()
    owner.run(0.5)
    last = owner.step - 1
    owner.run(0.052, sample=no_state)
    assert owner.report.warning
    owner.run(0.23, sample=no_state)
    assert 0.9 * HOVER.thrust < owner.wrench.thrust < HOVER.thrust
    owner.run(0.03, sample=no_state)
    assert owner.wrench.thrust == pytest.approx(0.05 * HOVER.thrust)
    owner.run(2.8, sample=no_state)
    assert owner.events == [
        (last + 51, GuardMode.DESCEND, GuardReason.STATE_LOST),
        (last + 1501, GuardMode.KILL, GuardReason.STATE_GONE),
    ]
    assert owner.wrench == Wrench(0.0, Vec3(0.0, 0.0, 0.0))


def test_a_tilt_that_is_predicted_alone_is_no_extreme_tilt():
    owner, trim = Owner(), Wrench(HOVER.thrust, Vec3(-0.1, 0.0, 0.0))
    sees = {"command": lambda it: it.good_command(trim)}
    sees["sample"] = lambda it: it.good_sample(height=1.5, rates=(1e-7 * (it.step % 2), 0.0, 0.0))
    owner.run(0.5, **sees)
    last = owner.step - 1
    owner.run(2.9, sample=no_state)  # the thrust ends after 2.1 s, and with it what held the torque of trim
    assert owner.memory.estimate.state.q_wb.w < 0.7
    assert owner.events == [(last + 51, GuardMode.DESCEND, GuardReason.STATE_LOST)]
    owner.run(0.2, **sees)
    assert owner.report.mode == GuardMode.DESCEND, "a state that returns is flown on"


def test_without_an_accepted_state_for_50_ms_the_thrust_passes_and_the_torque_is_that_of_trim():
    owner, given = Owner(), Wrench(9.0, Vec3(0.03, -0.02, 0.01))
    owner.run(0.5)
    last = owner.step - 1
    while owner.report.mode == GuardMode.PASS:
        owner.once(command=owner.good_command(given), sample=no_state(owner))
        if owner.step - 1 - last <= 25:
            assert owner.wrench == given
        elif owner.report.mode == GuardMode.PASS:
            # no torque turned it while it was seen, so what the hover's wrench had is all there is
            assert (owner.wrench.thrust, owner.wrench.torque_b) == (9.0, pytest.approx((0.0, 0.0, 0.0), abs=1e-9))
    owner = Owner()
    owner.run(0.5, command=lambda it: it.good_command(given))
    owner.run(0.08, command=lambda it: it.good_command(given), sample=no_state)
    owner.once(command=owner.good_command(given))
    assert owner.wrench == given


def test_what_never_came_is_lost_too_and_without_any_state_ever_the_motors_stop():
    commanded, seeing = Owner(), Owner()
    seeing.run(0.1, command=silent)
    assert seeing.events == [(26, GuardMode.DESCEND, GuardReason.WRENCH_LOST)]
    commanded.run(0.4, sample=no_state)
    assert commanded.wrench == Wrench(pytest.approx(0.94 * HOVER.thrust), Vec3(0.0, 0.0, 0.0))
    commanded.run(0.2, sample=no_state)
    assert commanded.events == [
        (51, GuardMode.DESCEND, GuardReason.STATE_LOST),
        (251, GuardMode.KILL, GuardReason.STATE_GONE),
    ]


def test_a_rate_that_repeats_itself_is_none():
    owner = Owner()
    owner.run(0.5)
    stale = flying(x=1.0, rates=(1.0, 0.0, 0.0))._replace(q_wb=Quat(math.nan, 0.0, 0.0, 1.0))
    owner.run(0.3, sample=lambda it: it.sample(stale))
    # its first reading turned the model, whose torque then stops the turn; a stale rate would never show that
    assert abs(owner.memory.estimate.state.omega_b.x) < 0.3
    owner.run(3.0, sample=lambda it: it.sample(stale))
    assert owner.events[-1][1] == GuardMode.KILL


def test_body_rates_alone_keep_the_motors_on():
    owner = Owner()
    owner.run(0.5)

    def without_attitude(it):
        seen = flying(x=it.step * DT, rates=(1e-6 * it.step, 0.0, 0.0))
        return it.sample(seen._replace(q_wb=Quat(math.nan, 0.0, 0.0, 1.0)))

    owner.run(4.0, sample=without_attitude)
    assert [event[1] for event in owner.events] == [GuardMode.DESCEND]
    assert owner.wrench.thrust == pytest.approx(0.94 * HOVER.thrust)


def test_a_frozen_state_is_a_silent_one():
    owner = Owner()
    owner.run(0.5)
    frozen = owner.good_sample().state
    owner.run(3.2, sample=lambda it: it.sample(frozen))
    assert [event[1:] for event in owner.events] == [
        (GuardMode.DESCEND, GuardReason.STATE_LOST),
        (GuardMode.KILL, GuardReason.STATE_GONE),
    ]


@pytest.mark.parametrize("spared", [True, False])
def test_ten_refused_samples_in_200_ms_end_the_flight_and_nine_do_not(spared):
    owner = Owner()
    owner.run(0.5)
    for number in range(9 if spared else 10):
        owner.once(sample=owner.good_sample()._replace(step=owner.step + 300))
        assert owner.report.mode == (GuardMode.PASS if number < 9 else GuardMode.DESCEND)
        owner.run(0.016)
    owner.run(0.3)
    assert owner.report.mode == (GuardMode.PASS if spared else GuardMode.DESCEND)
    assert owner.report.refused_samples == (9 if spared else 10)


def test_a_commander_is_told_to_land_where_the_position_is_good():
    owner = Owner(has_commander=True)
    owner.run(0.5)
    for _ in range(10):
        owner.once(sample=owner.good_sample()._replace(step=owner.step + 300))
    assert owner.report.mode == GuardMode.PASS
    assert owner.report.land


def test_a_jump_that_stays_is_a_reset_and_ends_the_flight_even_with_a_commander():
    owner = Owner(has_commander=True)
    owner.run(0.5)
    owner.run(0.1, sample=lambda it: it.sample(flying(x=4.0 + it.step * DT)))
    assert owner.events == [(259, GuardMode.DESCEND, GuardReason.STATE_REFUSED)]
    assert owner.memory.estimate.state.p_w.x == pytest.approx(4.0 + owner.step * DT, abs=2 * DT)


def turned(yaw, roll=0.0, **jump):
    """Return a source of samples whose attitude has jumped by ``yaw`` and ``roll`` rad, and x by ``jump`` m."""

    def sample(it):
        seen = flying(x=it.step * DT + jump.get("x", 0.0))
        return it.sample(seen._replace(q_wb=quaternion_from_euler(Vec3(roll, 0.0, yaw))))

    return sample


@pytest.mark.parametrize("jump", [(3.0, 0.0), (-0.4, 0.0), (0.0, 0.6), (1.0, -0.5)])
@pytest.mark.parametrize("x", [0.0, 3.0])
@pytest.mark.parametrize("has_commander", [False, True])
def test_an_attitude_that_jumps_is_not_believed_and_that_of_before_is_carried_on(jump, x, has_commander):
    owner = Owner(has_commander=has_commander)
    owner.run(0.5)
    owner.run(0.3, sample=turned(*jump, x=x))
    assert owner.events == [(259, GuardMode.DESCEND, GuardReason.HEADING)]
    estimate = owner.memory.estimate
    assert estimate.state.q_wb == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=0.05)
    assert estimate.state.p_w.x == pytest.approx(x + owner.step * DT, abs=2 * DT)
    assert owner.wrench.torque_b.y < 0.0  # leans against the 1 m/s along x
    assert abs(owner.wrench.torque_b.x) < 0.1 * abs(owner.wrench.torque_b.y)
    # nothing is given back until the attitudes agree
    owner.run(0.5, sample=turned(*jump, x=x), request=GuardRequest.RELEASE)
    assert owner.report.mode == GuardMode.DESCEND
    owner.run(0.5, sample=turned(0.0, x=x), request=GuardRequest.RELEASE)
    assert owner.report.mode == GuardMode.PASS


@pytest.mark.parametrize(("jump", "rate"), [(-0.384, 3.0), (0.384, -6.0), (0.5, 9.0)])
def test_a_jump_of_the_heading_against_the_turn_is_named_all_the_same(jump, rate):
    owner = Owner()

    def spinning(it, yaw=0.0):
        q = quaternion_from_euler(Vec3(0.0, 0.0, rate * it.step * DT + yaw))
        return it.sample(flying(x=it.step * DT, rates=(0.0, 0.0, rate))._replace(q_wb=q))

    owner.run(0.5, sample=spinning)
    # the same rates again and again would be a frozen gyro's
    owner.run(0.3, sample=lambda it: wiggled(spinning(it, jump), it.step))
    assert owner.events == [(259, GuardMode.DESCEND, GuardReason.HEADING)]


def wiggled(sample, step):
    rates = sample.state.omega_b
    return sample._replace(state=sample.state._replace(omega_b=rates._replace(x=1e-6 * (1 + step % 2))))


def test_an_attitude_that_returns_after_a_gap_is_believed_however_it_has_turned():
    owner = Owner()
    owner.run(0.5)
    owner.run(1.0, sample=no_state)
    owner.run(0.2, sample=turned(0.0, 0.6))
    assert owner.events == [(250 + 50, GuardMode.DESCEND, GuardReason.STATE_LOST)]
    assert owner.memory.estimate.state.q_wb == owner.memory.estimate.sample.q_wb


def test_an_attitude_that_is_carried_on_turns_with_the_body_rates():
    owner = Owner()
    owner.run(0.5)
    attitude = quaternion_from_euler(Vec3(0.0, 0.0, 2.0))
    owner.run(0.4, sample=lambda it: it.sample(flying(x=it.step * DT, rates=(0.0, 0.0, 0.5))._replace(q_wb=attitude)))
    assert owner.memory.estimate.state.q_wb.z == pytest.approx(math.sin(0.1), abs=0.015)  # half of 0.2 rad


def test_a_torque_that_no_wrench_explains_is_known_and_kept_over_a_gap():
    owner = Owner()
    owner.run(1.0, sample=lambda it: it.good_sample(rates=(it.step * DT, 0.0, 0.0)))
    known = owner.memory.unknown.torque
    assert known.x == pytest.approx(VEHICLE.inertia_xx * 1.0, rel=0.01)
    owner.run(0.3, sample=no_state)
    owner.once(sample=owner.good_sample(rates=(-1.0, 0.0, 0.0)))
    assert owner.memory.unknown.torque == known


def test_a_second_jump_and_one_while_descending_change_nothing():
    owner = Owner()
    owner.run(0.5)
    owner.run(0.2, command=silent)
    for yaw in (2.0, -1.0):
        owner.run(0.2, sample=turned(yaw))
        assert owner.memory.estimate.state.q_wb == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=0.05)
        assert owner.report.condition == GuardReason.HEADING


@pytest.mark.parametrize(("degrees", "height", "expected"), [
    (59.0, 5.0, None),
    (61.0, 5.0, (0.3, GuardMode.DESCEND, GuardReason.TILT)),
    (61.0, 0.5, (0.3, GuardMode.DESCEND, GuardReason.TILT)),
    (76.0, 5.0, (0.1, GuardMode.DESCEND, GuardReason.EXTREME_TILT)),
    (76.0, 0.9, (0.1, GuardMode.KILL, GuardReason.EXTREME_TILT_LOW)),
    (180.0, 0.9, (0.1, GuardMode.KILL, GuardReason.EXTREME_TILT_LOW)),
])  # fmt: skip
def test_tilt_is_borne_for_its_time_only(degrees, height, expected):
    owner = Owner()
    owner.run(1.0, sample=leaning(degrees, height))
    if expected is None:
        assert owner.events == []
        return
    time, mode, reason = expected
    step, *found = owner.events[0]
    assert (round((step + 1) * DT, 9), *found) == (pytest.approx(time, abs=1.6 * DT), mode, reason)


@pytest.mark.parametrize(
    ("rate", "seconds", "reason"), [(14.9, 1.0, None), (-15.1, 0.028, None), (-15.1, 0.034, GuardReason.SPIN)]
)
def test_a_vehicle_that_spins_is_not_the_controllers_to_fly(rate, seconds, reason):
    owner = Owner()
    owner.run(0.1)
    owner.run(seconds, sample=lambda it: it.good_sample(rates=(0.0, 0.0, rate)))
    assert [event[1:] for event in owner.events] == ([(GuardMode.DESCEND, reason)] if reason else [])


def test_a_short_lean_is_forgotten():
    owner = Owner()
    for _ in range(5):
        for degrees in (15.0, 30.0, 45.0):
            owner.once(sample=leaning(degrees)(owner))
        owner.run(0.29, sample=leaning(62.0))
        for degrees in (45.0, 30.0, 15.0):
            owner.once(sample=leaning(degrees)(owner))
    assert owner.events == []


def test_the_guard_gives_back_only_on_request_and_when_all_has_been_good_for_a_while():
    owner = Owner()
    owner.run(0.5)
    owner.run(0.2, command=silent)
    owner.run(0.19, request=GuardRequest.RELEASE)
    assert owner.report.mode == GuardMode.DESCEND
    owner.run(1.0)
    assert (owner.report.mode, owner.report.condition) == (GuardMode.DESCEND, GuardReason.GOOD)
    owner.run(0.01, request=GuardRequest.RELEASE)
    assert owner.report.mode == GuardMode.PASS
    assert owner.wrench == HOVER


def test_nothing_is_given_back_to_a_controller_that_is_not_there_or_while_leaning():
    for command, sample in ((silent, None), (None, leaning(40.0)), (None, no_state)):
        owner = Owner()
        owner.run(0.5)
        owner.run(0.2, command=silent)
        owner.run(0.4, command, sample, GuardRequest.RELEASE)
        assert owner.report.mode == GuardMode.DESCEND, (command, sample)


def test_kill_is_final():
    owner = Owner()
    owner.run(0.5)
    owner.once(request=GuardRequest.KILL)
    assert owner.events == [(250, GuardMode.KILL, GuardReason.REQUESTED_KILL)]
    owner.run(2.0, request=GuardRequest.RELEASE)
    owner.run(0.1, request=GuardRequest.DESCEND)
    assert owner.report.mode == GuardMode.KILL
    assert owner.wrench == Wrench(0.0, Vec3(0.0, 0.0, 0.0))


numbers = st.one_of(st.floats(), st.floats(-10.0, 10.0))


@settings(max_examples=300)
@given(st.lists(st.tuples(*(numbers,) * 17, st.integers(-5, 40), st.integers(0, 3)), max_size=40))
def test_whatever_arrives_the_rotors_get_finite_numbers(rows):
    owner = Owner()
    owner.run(0.02)
    for row in rows:
        wrench = Wrench(row[0], Vec3(*row[1:4]))
        state = flying()._replace(
            p_w=Vec3(*row[4:7]), v_w=Vec3(*row[7:10]), q_wb=Quat(*row[10:14]), omega_b=Vec3(*row[14:17])
        )
        late, request = row[17:]
        command = WrenchCommand(wrench, owner.step - late, True)
        before = owner.memory.mode
        owner.once(command, owner.sample(state), request)
        assert all(map(math.isfinite, (owner.wrench.thrust, *owner.wrench.torque_b)))
        assert owner.report.mode >= before or request == GuardRequest.RELEASE


IDLE = Wrench(0.5 * HOVER.thrust, Vec3(0.0, 0.0, 0.0))


def standing(height=0.1, speed=0.05):
    """Return a source of samples of a vehicle at rest, each with other low-order bits."""

    def sample(it):
        p, v = Vec3(1e-9 * it.step, 0.0, height), Vec3(0.0, 0.0, speed)
        return it.sample(VehicleState(p, v, Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0)))

    return sample


def stood(seconds, wrench=IDLE, **state):
    """Return the guard's report after a vehicle stood for some time under ``wrench``."""
    owner = Owner()
    return owner.run(seconds, lambda it: it.good_command(wrench), standing(**state))


def test_contact_is_half_a_second_at_rest_low_and_under_too_little_thrust_to_fly():
    assert (stood(0.4).on_ground, stood(0.4).contact) == (True, False)
    assert (stood(0.52).on_ground, stood(0.52).contact) == (True, True)
    for changes in ({"height": 0.31}, {"speed": 0.11}, {"wrench": HOVER}):
        assert not stood(3.0, **changes).on_ground, changes


def test_without_an_accepted_state_there_is_no_contact():
    owner = Owner()
    owner.run(0.4, lambda it: it.good_command(IDLE), standing())
    assert owner.report.on_ground
    owner.run(0.4, lambda it: it.good_command(IDLE), no_state)
    assert not owner.report.on_ground
