"""Sensor models against independent statistics, frames by rotation matrices of SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_core.types import Quat, Vec3, VehicleState
from quad_mavlink.hil import sensors
from quad_mavlink.hil.parameters import (
    AccelerometerParameters,
    BarometerParameters,
    GpsParameters,
    HomeParameters,
    JoinedPlantParameters,
    MagnetometerParameters,
    RateGyroParameters,
)

G = 9.81
FRD = np.diag([1.0, -1.0, -1.0])
QUIET = JoinedPlantParameters(
    gyro=RateGyroParameters(0.0, 0.0, 1.0, 0.0),
    accelerometer=AccelerometerParameters(0.0, 0.0, 1.0, 0.0),
    magnetometer=MagnetometerParameters(noise_density=0.0, bias_walk=0.0),
    barometer=BarometerParameters(noise=0.0, drift=0.0),
    gps=GpsParameters(walk=0.0, vertical_walk=0.0, velocity_noise=0.0),
)
SOME = np.ones(sensors.COLUMNS)


def at(angles=(0.0, 0.0, 0.0), v=(0.0, 0.0, 0.0), omega=(0.0, 0.0, 0.0), p=(0.0, 0.0, 0.0)):
    q = Rotation.from_euler("ZYX", angles).as_quat()
    return VehicleState(Vec3(*p), Vec3(*v), Quat(*q.tolist()), Vec3(*omega))


def read(before, now, parameters=QUIET, dt=0.004, row=SOME):
    return sensors.inertial(parameters, sensors.Memory(), before, now, G, dt, row)[0]


def test_at_rest_and_level_the_accelerometer_feels_g_upward_which_is_minus_z_of_frd():
    assert read(at(), at()).force == pytest.approx((0.0, 0.0, -G))


@pytest.mark.parametrize("angles", [(0.0, 0.3, 0.0), (0.0, 0.0, 0.3), (1.2, -0.4, 0.7), (-2.5, 0.1, -0.2)])
def test_specific_force_and_field_turn_with_the_body(angles):
    before, now = at(angles, v=(1.0, 2.0, 3.0)), at(angles, v=(1.01, 1.98, 3.03))
    to_frd = FRD @ Rotation.from_euler("ZYX", angles).as_matrix().T
    expected = to_frd @ (np.array([0.01, -0.02, 0.03]) / 0.004 + [0.0, 0.0, G])
    assert read(before, now).force == pytest.approx(expected)
    home = HomeParameters(field_strength=0.5, field_declination=10.0, field_inclination=50.0)
    field, _ = sensors.compass(QUIET._replace(home=home), sensors.Memory(), now.q_wb, 0.016, SOME)
    d, i = np.radians([10.0, 50.0])
    ned = 0.5 * np.array([np.cos(i) * np.cos(d), np.cos(i) * np.sin(d), np.sin(i)])
    assert field == pytest.approx(to_frd @ np.array([ned[1], ned[0], -ned[2]]))


def test_a_level_nose_to_the_north_reads_the_field_as_ned():
    home = HomeParameters(field_strength=0.5, field_declination=0.0, field_inclination=60.0)
    north = at((np.pi / 2.0, 0.0, 0.0))  # yaw is counted from east
    field, _ = sensors.compass(QUIET._replace(home=home), sensors.Memory(), north.q_wb, 0.016, SOME)
    assert field == pytest.approx((0.25, 0.0, 0.5 * np.sqrt(0.75)))


def test_free_fall_is_felt_as_nothing():
    assert read(at(), at(v=(0.0, 0.0, -G * 0.004))).force == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_rates_are_frd():
    assert read(at(), at(omega=(0.1, 0.2, 0.3))).rate == pytest.approx((0.1, -0.2, -0.3))


def test_a_turning_vehicle_feels_gravity_as_it_stands_half_way():
    dt, rate = 0.01, 5.0
    before, now = at((0.0, 0.0, 0.0)), at((0.0, 0.0, rate * dt))
    half = FRD @ Rotation.from_euler("x", 0.5 * rate * dt).as_matrix().T @ [0.0, 0.0, G]
    assert read(before, now, dt=dt).force == pytest.approx(half)
    negative = now._replace(q_wb=Quat(*(-part for part in now.q_wb)))
    assert read(before, negative, dt=dt).force == pytest.approx(half)


def series(parameters, count, dt, seed=3):
    memory, found, still = sensors.Memory(), [], at()
    rows = np.random.default_rng(seed).standard_normal((count, sensors.COLUMNS))
    for row in rows:
        reading, memory = sensors.inertial(parameters, memory, still, still, G, dt, row)
        found.append((*reading.rate, *reading.force))
    return np.array(found)


@pytest.mark.parametrize("dt", [0.004, 0.01])
def test_white_noise_has_its_density_whatever_the_rate(dt):
    gyro, accelerometer = RateGyroParameters(3e-4, 0.0, 1.0, 0.0), AccelerometerParameters(4e-3, 0.0, 1.0, 0.0)
    found = series(QUIET._replace(gyro=gyro, accelerometer=accelerometer), 20_000, dt)
    # the integral over time of noise of density N has variance N^2 t
    length = 100
    sums = dt * (found - found.mean(axis=0)).reshape(-1, length, 6).sum(axis=1)
    density = sums.std(axis=0) / np.sqrt(length * dt)
    assert density[:3] == pytest.approx([3e-4] * 3, rel=0.15)
    assert density[3:] == pytest.approx([4e-3] * 3, rel=0.15)
    correlation = np.corrcoef(found.T) - np.eye(6)
    assert np.abs(correlation).max() < 0.04  # axes and sensors are independent


@pytest.mark.parametrize("channel", ["gyro", "accelerometer"])
def test_the_bias_walks_as_its_density_says_and_no_further_than_its_time_lets_it(channel):
    walk, time, dt = 1e-3, 50.0, 0.1
    gyro, accelerometer = RateGyroParameters(0.0, 0.0, time, 0.0), AccelerometerParameters(0.0, 0.0, time, 0.0)
    quiet = QUIET._replace(gyro=gyro, accelerometer=accelerometer)
    walking = quiet._replace(**{channel: getattr(quiet, channel)._replace(bias_walk=walk)})
    both = series(walking, 100_000, dt)
    found, other = (both[:, :3], both[:, 3:]) if channel == "gyro" else (both[:, 3:], both[:, :3])
    assert np.ptp(other, axis=0) == pytest.approx([0.0] * 3)
    # Allan variance of a random walk: K^2 tau / 3, for tau far below the correlation time
    size = 20
    means = found[: len(found) // size * size].reshape(-1, size, 3).mean(axis=1)
    allan = 0.5 * np.mean(np.diff(means, axis=0) ** 2, axis=0)
    assert np.sqrt(allan) == pytest.approx([walk * np.sqrt(size * dt / 3.0)] * 3, rel=0.05)
    # steady: variance K^2 T / 2, correlation exp(-t/T)
    assert found.std(axis=0) == pytest.approx([walk * np.sqrt(0.5 * time)] * 3, rel=0.2)
    lag = round(time / dt)
    correlation = [np.corrcoef(axis[:-lag], axis[lag:])[0, 1] for axis in found.T]
    assert np.mean(correlation) == pytest.approx(np.exp(-1.0), abs=0.1)


def test_the_bias_at_step_0_is_drawn_and_stays():
    parameters = QUIET._replace(
        gyro=RateGyroParameters(0.0, 0.0, 1000.0, 0.01), accelerometer=AccelerometerParameters(0.0, 0.0, 300.0, 0.2)
    )
    memories = [sensors.init(parameters, sensors.draw(seed, 0)[0]) for seed in range(400)]
    assert np.std([memory.gyro for memory in memories]) == pytest.approx(0.01, rel=0.1)
    assert np.std([memory.accelerometer for memory in memories]) == pytest.approx(0.2, rel=0.1)
    reading, _ = sensors.inertial(parameters, memories[0], at(), at(), G, 0.004, SOME)
    assert reading.rate == pytest.approx(FRD @ np.array(memories[0].gyro), rel=1e-4)


def test_draws_are_seeded_and_blocks_are_independent():
    first, again = sensors.draw(5, 0), sensors.draw(5, 0)
    assert np.array_equal(first, again)
    assert first.shape == (sensors.BLOCK, sensors.COLUMNS)
    for other in (sensors.draw(6, 0), sensors.draw(5, 1)):
        assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.02


def test_magnetometer_noise_has_its_density():
    parameters = QUIET._replace(magnetometer=MagnetometerParameters(noise_density=4e-4, bias_walk=0.0))
    rows = np.random.default_rng(1).standard_normal((5000, sensors.COLUMNS))
    found = [sensors.compass(parameters, sensors.Memory(), at().q_wb, 0.016, row)[0] for row in rows]
    assert np.std(found, axis=0) == pytest.approx([4e-4 / np.sqrt(0.016)] * 3, rel=0.05)


def test_the_barometer_reads_the_standard_atmosphere_with_noise_and_drift():
    home = HomeParameters(altitude=488.0)
    quiet = sensors.air(QUIET.barometer, home, 12.0, 0.0, SOME)
    assert quiet.pressure == pytest.approx(101325.0 * (1.0 - 2.25577e-5 * 500.0) ** 5.25588, rel=1e-5)
    assert quiet.altitude == pytest.approx(500.0, abs=0.01)
    assert quiet.temperature == pytest.approx(11.75)
    noisy = BarometerParameters(noise=1.2, drift=0.028)
    rows = np.random.default_rng(1).standard_normal((5000, sensors.COLUMNS))
    found = np.array([sensors.air(noisy, home, 12.0, 100.0, row).pressure for row in rows]) - quiet.pressure
    assert found.std() == pytest.approx(1.2, rel=0.05)
    assert found.mean() == pytest.approx(2.8, abs=0.1)


def test_a_fix_is_where_the_vehicle_was_and_its_velocity_is_ned():
    found, _ = sensors.fix(
        QUIET.gps,
        HomeParameters(0.0, 0.0, 100.0),
        sensors.Memory(),
        at(v=(1.0, 2.0, 3.0), p=(0.0, 111.0, 5.0)),
        0.1,
        SOME,
    )
    assert found.velocity == pytest.approx((2.0, 1.0, -3.0))
    assert found.place.latitude == pytest.approx(111.0 / 110574.0, rel=1e-4)
    assert found.place.longitude == 0.0
    assert found.place.altitude == 105.0


def test_the_error_of_a_fix_wanders_and_that_of_its_velocity_does_not():
    parameters = GpsParameters(walk=0.2, vertical_walk=0.4, walk_time=1100.0, velocity_noise=0.05)
    rows = np.random.default_rng(2).standard_normal((4000, sensors.COLUMNS))
    memory, errors, velocities = sensors.Memory(), [], []
    for row in rows:
        found, memory = sensors.fix(parameters, HomeParameters(0.0, 0.0, 0.0), memory, at(), 0.1, row)
        errors.append(
            (np.radians(found.place.longitude) * 6378137.0, found.place.latitude * 110574.3, found.place.altitude)
        )
        velocities.append(found.velocity)
    steps = np.diff(errors, axis=0)
    assert steps.std(axis=0) == pytest.approx(np.array([0.2, 0.2, 0.4]) * np.sqrt(0.1), rel=0.05)
    assert np.std(velocities, axis=0) == pytest.approx([0.05] * 3, rel=0.05)
    centred = np.array(velocities)
    assert abs(np.corrcoef(centred[:-1, 0], centred[1:, 0])[0, 1]) < 0.05
