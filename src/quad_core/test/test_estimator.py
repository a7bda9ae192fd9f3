"""An estimator's samples as states on the grid: stamps, resets, derived motion, twists that do not fit."""

import math
import random
import re

import pytest
from scipy.spatial.transform import Rotation

from quad_core.estimator import Estimator, Sample
from quad_core.types import Quat, Vec3

PERIOD = 2_000_000


def truth(t):
    """Return p, v (world), q and body rates of a vehicle on a circle of 2 m at 1 rad/s that turns its nose along."""
    p = Vec3(2.0 * math.cos(t), 2.0 * math.sin(t), 1.0)
    v = Vec3(-2.0 * math.sin(t), 2.0 * math.cos(t), 0.0)
    yaw = 0.7 + 1.0 * t
    return p, v, Quat(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)), Vec3(0.0, 0.0, 1.0)


def sample(k, every=1, pose_alone=False):
    t = k * every * 0.002
    p, v, q, w = truth(t)
    v_b = Rotation.from_quat(q).inv().apply(v)
    twist = (None, None) if pose_alone else (Vec3(*v_b), w)
    return Sample(round(t * 1e9), t, p, q, *twist)


def estimator(from_first=False, lockstep=False, delay=0.0):
    return Estimator("est/odom", PERIOD, from_first, lockstep, delay)


def flown(one, samples):
    """Return what is made of ``samples``, and the words about them."""
    found = []
    for k, given in enumerate(samples):
        one.owner_is_at(k)
        found.append(one.take(given))
    return found, [text for _, text in one.news]


@pytest.mark.parametrize("jitter_ns", [1_000, 200_000, 900_000])
def test_stamps_are_put_on_the_grid_and_their_jitter_counted(jitter_ns):
    rng, one = random.Random(1), estimator()
    moved = [sample(k) for k in range(200)]
    moved = [
        given._replace(stamp_ns=given.stamp_ns + (rng.randrange(jitter_ns) if given.stamp_ns else 0)) for given in moved
    ]
    found, said = flown(one, moved)
    assert [step for step, _ in found] == list(range(200))
    assert said == []
    assert 0.9 * jitter_ns < one.jitter_ns <= jitter_ns
    assert one.counts["stamps_off_grid"] >= 198


def test_a_clean_twist_passes_to_the_bit_and_has_no_age():
    found, said = flown(estimator(), [sample(k) for k in range(300)])
    for k in (0, 150, 299):
        step, state = found[k]
        p, v, _, w = truth(0.002 * k)
        assert (step, state.p_w, state.omega_b) == (k, p, w)
        assert state.v_w == pytest.approx(v, abs=1e-12)
        assert state.position_age == state.velocity_age == state.attitude_age == state.rate_age == 0.0
    assert said == []


@pytest.mark.parametrize("every", [1, 2, 4, 5, 10])
def test_a_pose_alone_gives_velocity_and_rates_that_say_how_old_they_are(every):
    found, _ = flown(estimator(delay=0.01), [sample(k, every, pose_alone=True) for k in range(300 // every)])
    step, state = found[-1]
    assert state.velocity_age == state.rate_age == pytest.approx(0.01 + max(0.012, 0.002 * every), abs=0.003)
    assert state.position_age == state.attitude_age == 0.01
    _, v, _, w = truth(0.002 * step - (state.velocity_age - 0.01))
    assert state.v_w == pytest.approx(v, abs=2e-3)
    assert state.omega_b == pytest.approx(w, abs=2e-3)


def test_doubled_swapped_and_missing_samples_are_counted():
    order = [*range(50), 49, 51, 50, *range(52, 100), *range(103, 120)]
    one = estimator()
    found, _ = flown(one, [sample(k) for k in order])
    steps = [step for step, _ in (one for one in found if one)]
    assert steps == [*range(50), 51, *range(52, 100), *range(103, 120)]
    assert dict(one.counts) == {"doubled_samples": 1, "swapped_samples": 1, "missing_samples": 1 + 3}


def test_a_jump_is_a_reset_and_the_states_go_on_without_a_step():
    moved = [sample(k) for k in range(200)]
    aside = [given._replace(p_w=given.p_w._replace(x=given.p_w.x + 3.0)) for given in moved[100:]]
    found, said = flown(estimator(), [*moved[:100], *aside])
    assert len(said) == 1
    assert said[0].startswith("est/odom: jumped by 3.00 m")
    for step, state in (found[99], found[100], found[199]):
        assert state.p_w == pytest.approx(truth(0.002 * step)[0], abs=1e-3)


def test_a_reset_that_undoes_the_motion_over_lost_samples_is_taken_off_too():
    poses = [
        Sample(k * PERIOD, 0.002 * k, Vec3(0.02 * k, 0.0, 1.0), Quat(), Vec3(10.0, 0.0, 0.0), Vec3()) for k in range(90)
    ]
    back = [given._replace(p_w=given.p_w._replace(x=given.p_w.x - 0.5)) for given in poses[75:]]
    one = estimator()
    before, after = flown(one, poses[:50])[0], [one.take(given) for given in back]
    assert [text.partition(" and")[0] for _, text in one.news] == ["est/odom: jumped by 0.50 m"]
    for step, state in (before[-1], after[0], after[-1]):
        assert state.p_w.x == pytest.approx(0.02 * step, abs=1e-9)


@pytest.mark.parametrize(("degrees", "kinds"), [(15.0, []), (25.0, ["wrong_pose", "estimator_reset"])])
def test_an_attitude_that_jumps_is_no_vehicles(degrees, kinds):
    one, turn = estimator(), Rotation.from_euler("z", degrees, degrees=True)
    flown(one, [sample(k) for k in range(100)])
    one.take(sample(100)._replace(q_wb=Quat(*(turn * Rotation.from_quat(sample(100).q_wb)).as_quat())))
    assert [kind for kind, _ in one.news] == kinds
    assert all("25.1 deg within 2.0 ms" in text for _, text in one.news)


def test_a_stale_first_stamp_or_a_clock_that_is_set_begins_the_stamps_afresh():
    moved = [sample(k) for k in range(100)]
    late = [given._replace(stamp_ns=given.stamp_ns + 10**12) for given in moved[1:]]
    one = estimator(from_first=True)
    found, said = flown(one, [moved[0], *late])
    assert [step for step, _ in found] == list(range(100))
    assert said == ["est/odom: stamps jumped by 1000.000 s; they count afresh from here"]


def test_stamps_from_the_first_one_are_never_ahead_of_the_vehicle():
    one, steps = estimator(from_first=True), []
    for k in range(100):
        one.owner_is_at(k)
        given = sample(k)
        found = one.take(given._replace(stamp_ns=given.stamp_ns + 10**15 + (8_700_000 if k > 3 else 0)))
        steps += [(k, found[0])] if found else []
    assert all(step <= k for k, step in steps)
    assert len(steps) > 90
    assert steps[-1] == (99, 99)


@pytest.mark.parametrize("phase_ns", [0, 500_000, 1_000_000, 1_500_000])
def test_stamps_of_any_phase_against_the_grid_keep_nearly_every_sample(phase_ns):
    rng, one, taken = random.Random(3), estimator(from_first=True), 0
    one.wait(sample(0)._replace(stamp_ns=10**15 - phase_ns))
    for k in range(2000):
        one.owner_is_at(k + 3)
        jitter_ns = rng.randint(-400_000, 400_000)
        taken += one.take(sample(k)._replace(stamp_ns=k * PERIOD + 10**15 + jitter_ns)) is not None
    assert taken > 1970


def test_samples_at_twice_the_rate_of_the_plant_stay_on_their_steps():
    one, behind = estimator(from_first=True), []
    for k in range(8000):
        one.owner_is_at(k // 2)
        found = one.take(sample(k, 0.5))
        behind += [k / 2 - found[0]] if found else []
    assert len(behind) == pytest.approx(4000, abs=2)
    assert max(behind) <= 1.0


def wrong(given, mistake):
    """Return a sample with a twist that somebody got wrong."""
    v, w, turn = given.twist_linear, given.twist_angular, Rotation.from_quat(given.q_wb)
    made = {
        "world": (Vec3(*turn.apply(v)), w),
        "zero": (Vec3(), w),
        "sign": (Vec3(-v.x, -v.y, -v.z), w),
        "frd": (Vec3(v.x, -v.y, -v.z), w),
        "deg/s": (v, Vec3(*(math.degrees(part) for part in w))),
        "rate sign": (v, Vec3(-w.x, -w.y, -w.z)),
    }
    linear, angular = made[mistake]
    return given._replace(twist_linear=linear, twist_angular=angular)


LOOKS = {
    "world": "the world frame, expected the body frame",
    "zero": "a twist that is not filled in",
    "sign": "the wrong sign",
    "frd": "FRD axes, expected FLU",
    "deg/s": "deg/s, expected rad/s",
    "rate sign": "the wrong sign",
}


@pytest.mark.parametrize("every", [1, 5])
@pytest.mark.parametrize("mistake", LOOKS)
def test_each_wrong_twist_is_named_within_half_a_second_and_replaced(mistake, every):
    one = estimator()
    found, said = flown(one, [wrong(sample(k, every), mistake) for k in range(250 // every)])
    part = "angular" if "/s" in mistake or "rate" in mistake else "linear"
    assert len(said) == 1
    likeliest = said[0].partition("it looks like ")[2]
    assert LOOKS[mistake] in likeliest.partition("; ")[0]
    assert re.search(
        rf"twist.{part} does not fit the change of pose: found .*, the pose changes by .*; expected .* body frame",
        said[0],
    )
    step, state = found[-1]
    _, v, _, w = truth(0.002 * step - state.velocity_age)
    assert state.v_w == pytest.approx(v, abs=5e-3)
    assert state.omega_b == pytest.approx(w, abs=5e-3)


def test_a_noisy_twist_is_not_called_wrong():
    rng, one = random.Random(2), estimator()

    def noisy(v, sd):
        return Vec3(*(part + rng.gauss(0.0, sd) for part in v))

    moved = [sample(k) for k in range(1000)]
    moved = [
        given._replace(
            p_w=noisy(given.p_w, 0.005),
            twist_linear=noisy(given.twist_linear, 0.05),
            twist_angular=noisy(given.twist_angular, 0.05),
        )
        for given in moved
    ]
    _, said = flown(one, moved)
    assert said == []


@pytest.mark.parametrize("pose_alone", [False, True])
@pytest.mark.parametrize(("last", "words"), [(1, "the same pose"), (2, "the same poses"), (50, "the same poses")])
@pytest.mark.parametrize("lockstep", [False, True])
def test_a_moving_vehicle_whose_pose_is_to_the_bit_one_of_the_last_is_not_measured(lockstep, last, words, pose_alone):
    one = estimator(lockstep=lockstep)
    found, _ = flown(one, [sample(k, pose_alone=pose_alone) for k in range(100)])
    sent = [sample(100 - last + k % last, pose_alone=pose_alone) for k in range(150)]
    repeated = [one.take(old._replace(stamp_ns=k * PERIOD, arrived=0.002 * k)) for k, old in enumerate(sent, 100)]
    assert repeated == ([(k, found[99][1]) for k in range(100, 250)] if lockstep else 150 * [None])
    assert (one.stall, one.good_step, one.counts["repeated_samples"]) == (words, 99, 150)
    assert one.take(sample(250))[0] == one.good_step == 250
    assert one.stall == ""


@pytest.mark.parametrize("step", [0.0, 1e-3, 1e-15])
def test_a_vehicle_at_rest_may_stay_where_it_is_or_change_between_two_coarse_places(step):
    one = estimator()
    still = [Sample(k * PERIOD, 0.002 * k, Vec3(step * (k % 2)), Quat(), Vec3(), Vec3()) for k in range(100)]
    assert all(flown(one, still)[0])


@pytest.mark.parametrize("period_ns", [0, 10**9])
def test_stamps_that_stand_are_said_to(period_ns):
    one = estimator()
    stamped = [sample(k)._replace(stamp_ns=period_ns and k * PERIOD // period_ns * period_ns) for k in range(100)]
    found, _ = flown(one, stamped)
    assert [step for step, _ in filter(None, found)] == [0]
    assert one.stall == "its stamps do not advance"
    for given in stamped:
        one.wait(given)
    assert one.refusal() == "est/odom: its stamps do not advance, found 0.000 s in each"


@pytest.mark.parametrize(("changes", "words"), [
    ({"stamp_ns": 1_700_000_000_000_000_000}, "its stamps are of another clock: found 1700000000.000 s before"),
    ({"stamp_ns": -100_000_000_000}, "its stamps are of another clock: found -100.000 s before the flight"),
    ({"q_wb": Quat(1.0, 0.0, 0.0, 0.0)}, "found the vehicle 180 deg from upright before the flight"),
    ({"q_wb": Quat(1.0, 0.0, 0.0, 0.0)}, "it looks like a quaternion in the order w, x, y, z"),
    ({"q_wb": Quat(0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))}, "found the vehicle 90 deg from upright"),
])  # fmt: skip
def test_before_the_flight_a_stamp_or_an_attitude_that_cannot_be_is_refused(changes, words):
    one = estimator(lockstep=True)
    one.wait(sample(0))
    assert one.refusal() == ""
    one.wait(sample(0)._replace(**changes))
    assert words in one.refusal()


def test_what_comes_too_rarely_is_refused_with_the_numbers():
    one, said = estimator(), []
    for k in range(40):
        one.wait(sample(k)._replace(arrived=0.05 * k))
        said.append(one.refusal())
    found = [f"est/odom: found {n} messages, expected 20 to tell their spacing" for n in range(1, 20)]
    assert said[:19] == found
    assert set(said[19:]) == {"est/odom: samples 50.0 ms apart, expected at most 17 ms"}


@pytest.mark.parametrize("rate", [100.0, 60.0, 59.5])
def test_what_comes_60_times_a_second_can_be_flown(rate):
    one = estimator()
    for k in range(40):
        one.wait(sample(k)._replace(arrived=k / rate))
    assert one.refusal() == ""
