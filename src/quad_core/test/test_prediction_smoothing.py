"""The complementary filter of the attitude and the slower one of the position, on made-up readings."""

import math
import random

import pytest
from scipy.spatial.transform import Rotation

from quad_core.prediction import Prediction, predict, turned_towards, unknown
from quad_core.types import Actuation, Quat, Vec3, VehicleState
from quad_core.vehicle import Vehicle

VEHICLE = Vehicle(mass=1.3, gravity=9.81, drag_coefficient=0.0)
HOVER = Actuation(thrust=1.3 * 9.81)
DT = 0.002


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
    rng, known, errors = random.Random(5), unknown(), []
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
    rng, known, errors = random.Random(6), unknown(), []
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
