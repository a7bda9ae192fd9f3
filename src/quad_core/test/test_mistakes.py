"""Which mistake an estimator makes: held against a circle that is flown as its thrust and torque say."""

import math
import re
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_core.estimator import Drive, Estimator, Sample
from quad_core.mistakes import ANGULAR, LEAST_MOTION, Claim, Turn, Witness, likely
from quad_core.types import Quat, Vec3

sys.path.insert(0, str(Path(__file__).parents[3] / "test" / "accept"))
from spoiled import CHANGES

DT, GRAVITY = 0.002, 9.8
RADIUS, RATE = 1.5, 1.6  # m, rad/s


@cache
def truth(rate, seconds=0.8):
    """Return position, velocity, attitude, body rates and specific force of each step, and the torque over inertia."""
    t = np.arange(-1, round(seconds / DT) + 1) * DT
    cosine, sine, none = np.cos(rate * t), np.sin(rate * t), np.zeros_like(t)
    force = np.column_stack([-RADIUS * rate**2 * cosine, -RADIUS * rate**2 * sine, none + GRAVITY])
    size = np.linalg.norm(force, axis=1, keepdims=True)
    z = force / size
    x = np.cross(np.column_stack([-np.sin(0.7 + 0.3 * t), np.cos(0.7 + 0.3 * t), none]), z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    turn = Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=2))
    v = RADIUS * rate * np.column_stack([-sine, cosine, none])
    rates = np.vstack([(turn[:-1].inv() * turn[1:]).as_rotvec(), np.zeros(3)]) / DT
    parts = RADIUS * np.column_stack([cosine, sine, none]), turn.inv().apply(v), turn.as_quat(), rates, size[:, 0]
    return [list(part[1:-1]) for part in (*parts, np.gradient(rates, DT, axis=0))]


def flown(change=None, noise=0.0, unknown=0.0, pose_alone=False, rate=RATE):
    """Return [(time, kind, text)] of an estimate of the circle; ``unknown``: m/s^2 that the thrust does not show."""
    one, rng, said = Estimator("est/odom", 2_000_000, False, False, 0.0), np.random.default_rng(1), []
    for k, (place, velocity, turn, rates, force, spin) in enumerate(zip(*truth(rate), strict=True)):
        parts = place + rng.normal(0.0, noise, 3), turn, velocity, rates
        p, q, v, w = change(*parts) if change else parts
        twist = (None, None) if pose_alone else (vector(v), vector(w))
        one.drive(Drive(float(force) + unknown, GRAVITY, vector(spin)))
        one.take(Sample(k * 2_000_000, k * DT, vector(p), Quat(*map(float, q)), *twist))
        said += [(k * DT, *news) for news in one.news]
        one.news.clear()
    return said


def vector(parts):
    return Vec3(*map(float, parts))


WRONG_POSE = {
    "heading 15": "a heading that is off by 15 deg",
    "heading 45": "a heading that is off by 45 deg",
    "heading 90": "a heading that is off by 90 deg",
    "heading 180": "a heading that is off by 180 deg",
    "heading -90": "a heading that is off by -90 deg",
    "axes swapped": "x and y of the position swapped",
    "left-handed": "a left-handed frame, y mirrored",
    "ned position": "a position in NED, expected ENU",
    "mm": "the position jumped 5 times within 1 s",
    "cm": "the position jumped 5 times within 1 s",
    "ft": "a position in ft, expected m",
    "wxyz": "the attitude does not move as the wrench says",
    "conjugate": "a quaternion from the world to the body, expected body to world",
}
WRONG_TWIST = {
    "world twist": "the world frame, expected the body frame",
    "zero velocity": "a twist that is not filled in",
    "sign": "the wrong sign",
    "km/h": "km/h, expected m/s",
    "degrees": "deg/s, expected rad/s",
    "rates of other axes": "x and y swapped",
}


@pytest.mark.parametrize(("wrong", "words"), [*WRONG_POSE.items(), *WRONG_TWIST.items()])
def test_wrench_tells_which_of_pose_and_twist_is_wrong_and_a_table_how(wrong, words):
    kind = "wrong_pose" if wrong in WRONG_POSE else "wrong_twist"
    said = flown(CHANGES[wrong])
    named = [(time, text) for time, one, text in said if one == kind and words in text]
    assert named, said[:3]
    assert named[0][0] <= 0.6
    assert kind == "wrong_pose" or all(one == kind for _, one, _ in said), "a wrong twist throws no pose away"


@pytest.mark.parametrize(("rate", "within"), [(RATE, 3.0), (2.0 * RATE, 4.0)])
@pytest.mark.parametrize("angle", [90, 180, -90])
def test_a_heading_of_a_pose_alone_is_held_against_the_thrust(angle, rate, within):
    said = flown(CHANGES[f"heading {angle}"], pose_alone=True, rate=rate)
    assert {kind for _, kind, _ in said} == {"wrong_pose"}
    found = float(re.search(r"a heading that is off by (-?\d+) deg", said[0][2])[1])
    assert math.cos(math.radians(found - angle)) > math.cos(math.radians(within))


def test_a_scale_of_a_pose_alone_is_held_against_the_thrust():
    said = flown(CHANGES["ft"], pose_alone=True)
    assert {kind for _, kind, _ in said} == {"wrong_pose"}
    assert "it looks like a position in ft, expected m" in said[0][2]


@pytest.mark.parametrize("pose_alone", [False, True])
@pytest.mark.parametrize(("noise", "unknown"), [(0.0, 0.0), (0.003, 0.0), (0.0, 2.0)])
def test_an_honest_estimate_is_blamed_for_nothing(pose_alone, noise, unknown):
    assert flown(None, noise, unknown, pose_alone) == []


@pytest.mark.parametrize("pose_alone", [False, True])
def test_a_pose_that_stands_with_noise_while_nothing_brakes_the_vehicle_is_wrong(pose_alone):
    rng, sent = np.random.default_rng(2), []

    def stands(place, *others):
        sent.append((place, *others))
        place, *others = sent[min(len(sent) - 1, 250)]
        return place + rng.normal(0.0, 1e-3, 3), *others

    time, kind, text = flown(stands, pose_alone=pose_alone)[0]
    assert kind == "wrong_pose"
    assert 0.5 < time <= 0.7
    assert "the position does not move as the wrench says" in text


def kicked(t):
    """Return specific force in m/s^2 and pitch acceleration in rad/s^2: the vehicle pitches up and stops again."""
    return GRAVITY, 60.0 if 0.3 <= t < 0.4 else -60.0 if 0.4 <= t < 0.5 else 0.0


def lifted(t):
    return (3.0 if 0.3 <= t < 0.6 else 1.0) * GRAVITY, 0.0


def carried(motion, spoil, noise=0.0):
    """Return [(time, text)] of poses alone in the x-z plane; ``spoil``: what is sent of all (place, pitch)."""
    one, rng, said, seen = Estimator("est/odom", 2_000_000, False, False, 0.0), np.random.default_rng(3), [], []
    (x, z), (vx, vz), angle, rate = (0.0, 5.0), (0.5, 0.5), 0.0, 0.0
    for k in range(400):
        force, turning = motion(k * DT)
        seen.append(((x, 0.0, z), angle))
        place, pitch = spoil(seen)
        one.drive(Drive(force, GRAVITY, Vec3(0.0, turning, 0.0)))
        q = Quat(0.0, math.sin(0.5 * pitch), 0.0, math.cos(0.5 * pitch))
        one.take(Sample(k * 2_000_000, k * DT, vector(rng.normal(place, noise)), q))
        said += [(k * DT, text) for _, text in one.news]
        one.news.clear()
        rate, angle = rate + DT * turning, angle + DT * rate
        vx, vz = vx + DT * force * math.sin(angle), vz + DT * (force * math.cos(angle) - GRAVITY)
        x, z = x + DT * vx, z + DT * vz
    return said


LATE_OR_FRD = "the attitude does not move as the wrench says.*a pose that comes late, one sent again, FRD axes"
BEGUN_IN_THE_AIR = {
    "a pose 0.2 s late": (kicked, lambda seen: seen[max(0, len(seen) - 101)], LATE_OR_FRD, 0.1),
    "FRD": (kicked, lambda seen: (seen[-1][0], -seen[-1][1]), LATE_OR_FRD, 0.1),
    "z down": (lifted, lambda seen: ((*seen[-1][0][:2], -seen[-1][0][2]), 0.0), "a position whose z points down", 0.15),
}


@pytest.mark.parametrize("motion", [kicked, lifted])
@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_a_kick_that_the_pose_shows_is_blamed_on_nobody(motion, noise):
    assert carried(motion, lambda seen: seen[-1], noise) == []


@pytest.mark.parametrize("wrong", BEGUN_IN_THE_AIR)
def test_a_mistake_that_begins_in_the_air_is_named_before_the_vehicle_turns_over(wrong):
    motion, spoil, words, within = BEGUN_IN_THE_AIR[wrong]
    time, text = carried(motion, spoil)[0]
    assert 0.3 < time <= 0.301 + within
    assert re.search(words, text)


def test_an_attitude_that_stays_the_same_to_the_bit_under_noise_and_torque_was_not_measured():
    stands = {"kept": None}

    def spoil(seen):
        place, pitch = seen[-1]
        stands["kept"] = pitch + 1e-6 * len(seen) if len(seen) < 100 else stands["kept"]
        return place, stands["kept"]

    time, text = carried(lambda t: (GRAVITY, 1.0), spoil, 1e-4)[0]
    assert "the same attitude since 0.196 s, though torque turns the vehicle" in text
    assert 0.29 < time <= 0.32


def test_a_turn_is_told_once_enough_has_moved():
    turn = Turn(LEAST_MOTION)
    turn.note(Vec3(2.0, 0.0, 5.0), Vec3(0.0, 2.0, 0.0))
    assert turn.angle == 0.0
    turn.note(Vec3(2.0, 0.0, 5.0), Vec3(0.0, 2.0, 0.0))
    assert turn.angle == pytest.approx(0.5 * math.pi)


def test_wind_that_pushes_more_than_a_twist_is_wrong_blames_no_pose():
    witness, blamed, turn = Witness(), [], 0.0
    for t in np.arange(0.0, 2.0, 0.01):
        turn += 0.01 * 2.4 * max(0.0, t - 0.5)  # the twist is turned by more and more
        pose, pushes = 0.5 * t, Vec3(1.5 * t, 0.5 * t, 0.0)
        twist = Vec3(pose * math.cos(turn), pose * math.sin(turn), 0.0)
        witness.note(Claim(t, Vec3(pose, 0.0, 0.0), twist, pushes))
        blamed.append(witness.blames_pose)
    assert not any(blamed)


def test_what_explains_less_than_half_of_what_lies_between_is_no_explanation():
    assert likely(ANGULAR, Vec3(-1.0, 0.1, 0.0), Vec3(1.0, 0.0, 0.0)) == "the wrong sign"
    assert likely(ANGULAR, Vec3(9.0, 9.0, 9.0), Vec3(1.0, 0.0, 0.0)) == ""
