"""The predicted state against SciPy's integration of Eq. 1, its filters against SciPy's, and what it must not do."""

import math
import random

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from quad_core.prediction import UNKNOWN, Prediction, angular_acceleration, predict, turned_towards
from quad_core.types import Actuation, Quat, Vec3, VehicleState
from quad_core.vehicle import Vehicle

VEHICLE = Vehicle(mass=1.3, gravity=9.81, inertia_xx=0.011, inertia_yy=0.017, inertia_zz=0.026, drag_coefficient=0.0)
INERTIA = np.array([0.011, 0.017, 0.026])
DT = 0.002


def aged(age, **more):
    return Prediction(enabled=True, position_age=age, attitude_age=age, rate_age=age, **more)


def thrust_at(t):
    return 13.0 + 2.0 * math.sin(3.0 * t)


def torque_at(t):
    return np.array([0.02 * math.sin(6.0 * t), 0.03 * math.cos(5.0 * t), 0.01 * math.sin(4.0 * t)])


def flown(end):
    """Return SciPy's flight of Eq. 1 under the thrust and torque above: a function from time to the 13 numbers."""

    def rate(t, s):
        v, q, omega = s[3:6], s[6:10], s[10:13]
        up = Rotation.from_quat(q).apply([0.0, 0.0, 1.0])
        a = thrust_at(t) / 1.3 * up - [0.0, 0.0, 9.81]
        x, y, z, w = q
        p, r, u = omega
        turning = 0.5 * np.array(
            [w * p + y * u - z * r, w * r + z * p - x * u, w * u + x * r - y * p, -x * p - y * r - z * u]
        )
        alpha = (torque_at(t) - np.cross(omega, INERTIA * omega)) / INERTIA
        return np.concatenate([v, a, turning, alpha])

    start = np.concatenate([[1.0, 2.0, 3.0, 4.0, -3.0, 1.0], Rotation.from_euler("ZYX", [0.7, 0.4, -0.5]).as_quat()])
    start = np.concatenate([start, [1.5, -1.0, 0.5]])
    return solve_ivp(rate, (0.0, end), start, method="DOP853", rtol=1e-11, atol=1e-12, dense_output=True).sol


def as_state(numbers):
    p, v, q, omega = numbers[:3], numbers[3:6], numbers[6:10], numbers[10:]
    q = q / np.linalg.norm(q)
    return VehicleState(*(kind(*map(float, part)) for kind, part in ((Vec3, p), (Vec3, v), (Quat, q), (Vec3, omega))))


def along_a_flight(parameters, age, end=1.0):
    """Return predictions and truth at the steps of a flight whose states come ``age`` s late."""
    truth = flown(end)
    known, pairs = UNKNOWN, []
    for k in range(round(age / DT), round(end / DT)):
        now = k * DT
        actuation = Actuation(thrust=thrust_at(now - DT / 2), torque_b=Vec3(*map(float, torque_at(now - DT / 2))))
        state, known, shown = predict(parameters, VEHICLE, known, as_state(truth(now - age)), actuation, DT)
        pairs.append((state, as_state(truth(now)), shown))
    return pairs


@pytest.mark.parametrize(
    ("age", "position", "velocity", "attitude", "rate"),
    [(0.01, 2e-4, 0.03, 1.5e-3, 0.02), (0.02, 1e-3, 0.05, 6e-3, 0.06), (0.04, 4e-3, 0.1, 0.02, 0.2)],
)
def test_the_prediction_is_where_the_nominal_vehicle_went(age, position, velocity, attitude, rate):
    for state, truth, _ in along_a_flight(aged(age), age)[100:]:
        assert np.allclose(state.p_w, truth.p_w, atol=position)
        assert np.allclose(state.v_w, truth.v_w, atol=velocity)
        turn = (Rotation.from_quat(state.q_wb).inv() * Rotation.from_quat(truth.q_wb)).magnitude()
        assert turn < attitude
        assert np.allclose(state.omega_b, truth.omega_b, atol=rate)


def test_constant_wrench_is_predicted_by_hand():
    level = VehicleState(Vec3(1.0, 0.0, 5.0), Vec3(2.0, 0.0, -1.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0))
    actuation = Actuation(thrust=1.3 * 10.81, torque_b=Vec3(0.0, 0.0, 0.026))
    known = UNKNOWN
    for k in range(200):
        moving = level._replace(
            omega_b=Vec3(0.0, 0.0, 0.1 + 1e-9 * k),
            p_w=Vec3(1.0 + 1e-9 * k, 0.0, 5.0),
            q_wb=Quat(0.0, 0.0, 1e-9 * k, 1.0),
        )
        state, known, shown = predict(aged(0.02), VEHICLE, known, moving, actuation, DT)
    assert state.omega_b.z == pytest.approx(0.1 + 0.02 * 1.0, abs=1e-6)
    assert state.v_w == pytest.approx((2.0, 0.0, -1.0 + 0.02 * 1.0), abs=1e-9)
    assert state.p_w == pytest.approx((1.04, 0.0, 5.0 - 0.02 + 0.5 * 0.02 * 0.02), abs=1e-6)
    yaw = Rotation.from_quat(state.q_wb).as_euler("ZYX")[0]
    assert yaw == pytest.approx(0.02 * 0.11, abs=1e-6)
    assert shown.prediction_ages.x >= 0.02
    assert shown.predicted_shift_w.x == pytest.approx(0.04, abs=1e-6)


def test_the_angular_acceleration_is_that_of_eq_1():
    omega, torque = np.array([1.0, 2.0, 3.0]), np.array([0.01, -0.02, 0.03])
    expected = (torque - np.cross(omega, INERTIA * omega)) / INERTIA
    assert angular_acceleration(VEHICLE, Vec3(*omega), Vec3(*torque)) == pytest.approx(tuple(expected))


def test_each_channel_has_its_own_age():
    """While the vehicle rolls the thrust axis counts as it was in the middle of the time that the position is old."""
    state = VehicleState(Vec3(0.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(2.0, 0.0, 0.0))
    hover = Actuation(thrust=1.3 * 9.81)
    known = predict(aged(0.0), VEHICLE, UNKNOWN, state, hover, DT)[1]
    moved = state._replace(v_w=Vec3(1.0, 1e-9, 0.0), omega_b=Vec3(2.0, 1e-9, 0.0), q_wb=Quat(1e-9, 0.0, 0.0, 1.0))
    late = Prediction(enabled=True, position_age=0.05, attitude_age=0.01, rate_age=0.002)
    now, _, shown = predict(late, VEHICLE, known, moved, hover, DT)
    assert shown.prediction_ages == pytest.approx((0.05, 0.01, 0.002))
    assert now.p_w.x == pytest.approx(0.05, abs=1e-3)
    assert Rotation.from_quat(now.q_wb).as_euler("ZYX")[2] == pytest.approx(0.02, abs=1e-6)
    # level 0.01 s ago at 2 rad/s: from -0.08 to 0.02 rad of roll while the position aged
    rolls = np.linspace(-0.08, 0.02, 1001)
    assert now.v_w.y == pytest.approx(-9.81 * np.sin(rolls).mean() * 0.05, rel=1e-3)


@pytest.mark.parametrize(("attitude_age", "rate_age", "window"), [(0.02, 0.02, 0.02), (0.03, 0.01, 0.03)])
def test_a_new_torque_enters_the_rates_as_the_pade_form_of_a_mean_over_the_older_of_the_two(
    attitude_age, rate_age, window
):
    parameters = Prediction(enabled=True, attitude_age=attitude_age, rate_age=rate_age)
    known, rest = UNKNOWN, VehicleState(Vec3(), Vec3(), Quat(0.0, 0.0, 0.0, 1.0), Vec3())
    for k in range(13):  # the first step only begins
        fresh = rest._replace(q_wb=Quat(0.0, 0.0, 1e-12 * k, 1.0), omega_b=Vec3(0.0, 0.0, 1e-12 * k))
        now, known, _ = predict(parameters, VEHICLE, known, fresh, Actuation(torque_b=Vec3(0.0, 0.0, 0.026)), DT)
    share = 1.0 - math.exp(-2.0 * 12 * DT / window)
    assert now.omega_b.z == pytest.approx(rate_age * share, rel=1e-6)  # 1 rad/s^2
    assert 0.5 < share < 0.95, "far from both ends, so that its time constant counts"


def test_an_age_beyond_the_bound_is_said_of_each_channel():
    state = VehicleState(Vec3(), Vec3(1.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3())
    for channel in ("position_age", "attitude_age", "rate_age"):
        for age, said in ((0.029, 0.0), (0.031, 1.0)):
            late = Prediction(enabled=True, max_age=0.03, **{channel: age})
            assert predict(late, VEHICLE, UNKNOWN, state, Actuation(), DT)[2].age_bounded == said, (channel, age)


def test_a_new_velocity_makes_the_position_fresh():
    state = VehicleState(Vec3(1.0, 2.0, 3.0), Vec3(1.0, 2.0, 3.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.1, 0.2, 0.3))
    known = UNKNOWN
    for _ in range(4):
        _, known, shown = predict(aged(0.0), VEHICLE, known, state, Actuation(), DT)
    assert shown.prediction_ages == pytest.approx((0.006, 0.006, 0.006))
    for other in (Vec3(1.5, 2.0, 3.0), Vec3(1.0, 2.5, 3.0), Vec3(1.0, 2.0, 3.5)):
        ages = predict(aged(0.0), VEHICLE, known, state._replace(v_w=other), Actuation(), DT)[2].prediction_ages
        assert ages == pytest.approx((0.0, 0.008, 0.008))


def test_a_reading_that_repeats_grows_older_up_to_the_bound():
    state = VehicleState(Vec3(0.0, 0.0, 0.0), Vec3(5.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0))
    known, ages, flags, shifts = UNKNOWN, [], [], []
    for _ in range(12):
        _, known, shown = predict(aged(0.01, max_age=0.02), VEHICLE, known, state, Actuation(thrust=12.753), DT)
        ages.append(shown.prediction_ages.x)
        flags.append(shown.age_bounded)
        shifts.append(shown.predicted_shift_w.x)
    assert ages[:6] == pytest.approx([0.01, 0.012, 0.014, 0.016, 0.018, 0.02])
    assert ages[6:] == pytest.approx([0.02] * 6)
    assert flags == [0.0] * 6 + [1.0] * 6
    assert max(shifts) == pytest.approx(0.1)
    fresh = state._replace(p_w=Vec3(0.12, 0.0, 0.0), omega_b=Vec3(0.0, 0.0, 1e-6))
    _, _, shown = predict(aged(0.01, max_age=0.02), VEHICLE, known, fresh, Actuation(thrust=12.753), DT)
    # the attitude alone has not changed
    assert shown.prediction_ages == pytest.approx((0.01, 0.02, 0.01))


def test_a_wrong_age_shows_as_a_residual():
    truth = {age: along_a_flight(aged(0.02), age, 0.4)[-50:] for age in (0.02,)}
    known = max(np.linalg.norm(shown.prediction_residual_w) for _, _, shown in truth[0.02])
    jitter = np.random.default_rng(1).uniform(0.01, 0.03, 200)
    path, memory, seen = flown(0.4), UNKNOWN, []
    for k in range(50, 200):
        now = k * DT
        actuation = Actuation(thrust=thrust_at(now), torque_b=Vec3(*map(float, torque_at(now))))
        _, memory, shown = predict(aged(0.02), VEHICLE, memory, as_state(path(now - jitter[k])), actuation, DT)
        seen.append(np.linalg.norm(shown.prediction_residual_w))
    assert known < 1e-3
    assert np.median(seen[20:]) > 0.01


def test_velocity_is_filtered_like_a_critically_damped_alpha_beta_filter():
    rng, smoothing = np.random.default_rng(3), 20.0
    z = math.exp(-smoothing * DT)
    noise = rng.normal(0.0, 0.1, 400)
    noise[:2] = 0.0
    hover = Actuation(thrust=1.3 * 9.81)
    known, seen = UNKNOWN, []
    for value in noise:
        state = VehicleState(
            Vec3(0.0, 0.0, 0.0), Vec3(0.0, float(value), 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0)
        )
        now, known, _ = predict(Prediction(enabled=True, smoothing=smoothing), VEHICLE, known, state, hover, DT)
        seen.append(now.v_w.y)
    g, h = 1.0 - z * z, (1.0 - z) * (1.0 - z)
    # the g-h filter as one transfer function (Brookner, chapter 1)
    expected = lfilter([g, h - g], [1.0, g + h - 2.0, 1.0 - g], noise)
    assert seen == pytest.approx(list(expected), abs=1e-12)


def test_the_filter_learns_a_constant_disturbance_and_leaves_no_error():
    known, hover = UNKNOWN, Actuation(thrust=1.3 * 9.81)
    for k in range(2000):
        t = k * DT
        state = VehicleState(
            Vec3(0.4 * t * t, 0.0, 0.0), Vec3(0.8 * t, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0)
        )
        now, known, _ = predict(Prediction(enabled=True, smoothing=10.0, max_age=0.0), VEHICLE, known, state, hover, DT)
    assert known.disturbance_w.x == pytest.approx(0.8, abs=1e-6)
    assert now.v_w.x == pytest.approx(0.8 * t, abs=1e-6)
    assert now.p_w.x == pytest.approx(0.4 * t * t, abs=1e-6)


def test_rates_are_filtered_on_the_model():
    known, gain = UNKNOWN, 1.0 - math.exp(-50.0 * DT)
    still = VehicleState(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0))
    noise = np.random.default_rng(5).normal(0.0, 0.1, 300)
    noise[0] = 0.0
    seen = []
    for value in noise:
        state = still._replace(omega_b=Vec3(float(value), 0.0, 0.0))
        now, known, _ = predict(
            Prediction(enabled=True, rate_smoothing=50.0), VEHICLE, known, state, Actuation(thrust=12.753), DT
        )
        seen.append(now.omega_b.x)
    assert seen == pytest.approx(list(lfilter([gain], [1.0, gain - 1.0], noise)), abs=1e-12)


def test_a_fresh_state_without_age_is_left_as_it_is():
    state = as_state(flown(0.1)(0.05))
    now, _, shown = predict(aged(0.0), VEHICLE, UNKNOWN, state, Actuation(thrust=5.0), DT)
    assert (now.p_w, now.v_w, now.omega_b) == (state.p_w, state.v_w, state.omega_b)
    assert now.q_wb == pytest.approx(state.q_wb, abs=1e-15)
    assert shown.prediction_ages == (0.0, 0.0, 0.0)


HOVER = Actuation(thrust=1.3 * 9.81)


def quat(rotation):
    return Quat(*map(float, rotation.as_quat()))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_turned_towards_goes_the_stated_share_of_the_short_way(sign):
    start = Rotation.from_euler("ZYX", [0.5, -0.3, 1.1])
    end = start * Rotation.from_rotvec([0.02, -0.01, 0.03])
    target = Quat(*(sign * part for part in quat(end)))
    moved = Rotation.from_quat(turned_towards(quat(start), target, 50.0, DT))
    share = 1.0 - math.exp(-0.1)
    assert (start.inv() * moved).as_rotvec() == pytest.approx([share * 0.02, -share * 0.01, share * 0.03], rel=1e-3)


def spinning(parameters, noise, seconds=4.0, rate=1.5, bias=0.0):
    """Return the yaw errors in rad of a vehicle that turns steadily, its attitude read with noise or a bias."""
    rng, known, errors = random.Random(5), UNKNOWN, []
    for k in range(round(seconds / DT)):
        true = rate * k * DT
        read = Rotation.from_euler("ZYX", [true + bias + rng.gauss(0.0, noise), 0.0, 0.0])
        state = VehicleState(Vec3(1e-9 * k, 0.0, 0.0), Vec3(), quat(read), Vec3(0.0, 1e-9 * k, rate))
        now, known, _ = predict(parameters, VEHICLE, known, state, HOVER, DT)
        found = Rotation.from_quat(now.q_wb).as_euler("ZYX")[0]
        errors.append((found - true + math.pi) % (2.0 * math.pi) - math.pi)
    return errors[len(errors) // 2 :]


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values))


def test_attitude_noise_shrinks_by_the_known_factor_and_steady_turning_costs_nothing():
    """A first-order filter leaves sqrt(g / (2 - g)) of white noise, g = 1 - e^(-L T); the gyro carries the turn."""
    gain = 1.0 - math.exp(-5.0 * DT)
    found = rms(spinning(Prediction(enabled=True, attitude_smoothing=5.0), 0.02))
    assert found == pytest.approx(0.02 * math.sqrt(gain / (2.0 - gain)), rel=0.35)
    assert rms(spinning(Prediction(enabled=True), 0.02)) == pytest.approx(0.02, rel=0.1)
    assert max(map(abs, spinning(Prediction(enabled=True, attitude_smoothing=5.0), 0.0))) < 1e-6


def drifting(parameters, noise):
    """Return the position errors in m of a vehicle at 3 m/s whose position alone is noisy."""
    rng, known, errors = random.Random(6), UNKNOWN, []
    for k in range(4000):
        true = 3.0 * k * DT
        state = VehicleState(
            Vec3(true + rng.gauss(0.0, noise), 0.0, 0.0), Vec3(3.0, 0.0, 0.0), Quat(0, 0, 0, 1), Vec3()
        )
        now, known, _ = predict(parameters, VEHICLE, known, state, HOVER, DT)
        errors.append(now.p_w.x - true)
    return errors[2000:]


def test_position_noise_shrinks_with_its_own_bandwidth():
    same = rms(drifting(Prediction(enabled=True, smoothing=20.0), 0.01))
    slow = rms(drifting(Prediction(enabled=True, smoothing=20.0, position_smoothing=2.0), 0.01))
    gains = [1.0 - math.exp(-bandwidth * DT) for bandwidth in (20.0, 2.0)]
    expected = [0.01 * math.sqrt(gain / (2.0 - gain)) for gain in gains]
    assert same == pytest.approx(expected[0], rel=0.3)
    assert slow == pytest.approx(expected[1], rel=0.5)
    assert slow < 0.5 * same
