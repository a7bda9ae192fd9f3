"""Sensors against independent statistics, published tables, SciPy's rotations and MAVLink's own units."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_core.parameters import ParameterError
from quad_core.types import Quat, Vec3, VehicleState
from quad_mavlink import sensors
from quad_mavlink.sensors import Air, Fix, Home, Inertial, Noise, Place, Sensors, Suite

G = 9.81
FRD = np.diag([1.0, -1.0, -1.0])
QUIET = Sensors(
    gyro=Noise(),
    accelerometer=Noise(),
    magnetometer=Noise(),
    barometer_noise=0.0,
    barometer_drift=0.0,
    gps_walk=0.0,
    gps_vertical_walk=0.0,
    gps_velocity_noise=0.0,
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
    home = Home(field_strength=0.5, field_declination=10.0, field_inclination=50.0)
    field, _ = sensors.compass(QUIET._replace(home=home), sensors.Memory(), now.q_wb, 0.016, SOME)
    d, i = np.radians([10.0, 50.0])
    ned = 0.5 * np.array([np.cos(i) * np.cos(d), np.cos(i) * np.sin(d), np.sin(i)])
    assert field == pytest.approx(to_frd @ np.array([ned[1], ned[0], -ned[2]]))


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
    found = series(QUIET._replace(gyro=Noise(3e-4), accelerometer=Noise(4e-3)), 20_000, dt)
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
    both = series(QUIET._replace(**{channel: Noise(0.0, walk, time)}), 100_000, dt)
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
    parameters = QUIET._replace(gyro=Noise(turn_on=0.01), accelerometer=Noise(time=300.0, turn_on=0.2))
    rows = np.random.default_rng(5).standard_normal((400, sensors.COLUMNS))
    memories = [sensors.init(parameters, row) for row in rows]
    assert np.std([memory.gyro for memory in memories]) == pytest.approx(0.01, rel=0.1)
    assert np.std([memory.accelerometer for memory in memories]) == pytest.approx(0.2, rel=0.1)
    reading, _ = sensors.inertial(parameters, memories[0], at(), at(), G, 0.004, SOME)
    assert reading.rate == pytest.approx(FRD @ np.array(memories[0].gyro), rel=1e-4)


def test_the_barometer_reads_the_standard_atmosphere_with_noise_and_drift():
    quiet = sensors.air(QUIET, 12.0, 0.0, SOME)
    assert quiet.pressure == pytest.approx(101325.0 * (1.0 - 2.25577e-5 * 500.0) ** 5.25588, rel=1e-5)
    assert quiet.altitude == pytest.approx(500.0, abs=0.01)
    assert quiet.temperature == pytest.approx(11.75)
    rows = np.random.default_rng(1).standard_normal((5000, sensors.COLUMNS))
    found = np.array([sensors.air(Sensors(), 12.0, 100.0, row).pressure for row in rows]) - quiet.pressure
    assert found.std() == pytest.approx(1.2, rel=0.05)
    assert found.mean() == pytest.approx(2.8, abs=0.1)


def test_a_fix_is_where_the_vehicle_was_and_its_velocity_is_ned():
    found, _ = sensors.fix(
        QUIET._replace(home=Home(0.0, 0.0, 100.0)),
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
    noisy = Sensors(home=Home(0.0, 0.0, 0.0), gps_walk=0.2)
    rows = np.random.default_rng(2).standard_normal((4000, sensors.COLUMNS))
    memory, errors, velocities = sensors.Memory(), [], []
    for row in rows:
        found, memory = sensors.fix(noisy, memory, at(), 0.1, row)
        errors.append(
            (np.radians(found.place.longitude) * 6378137.0, found.place.latitude * 110574.3, found.place.altitude)
        )
        velocities.append(found.velocity)
    steps = np.diff(errors, axis=0)
    assert steps.std(axis=0) == pytest.approx(np.array([0.2, 0.2, 0.4]) * np.sqrt(0.1), rel=0.05)
    assert np.std(velocities, axis=0) == pytest.approx([0.05] * 3, rel=0.05)
    centred = np.array(velocities)
    assert abs(np.corrcoef(centred[:-1, 0], centred[1:, 0])[0, 1]) < 0.05


# ISO 2533: geopotential height m, pressure Pa, temperature degrees C
STANDARD = [(0.0, 101325.0, 15.0), (500.0, 95460.8, 11.75), (1000.0, 89874.6, 8.5), (5000.0, 54019.9, -17.5)]


@pytest.mark.parametrize(("height", "pascals", "celsius"), STANDARD)
def test_the_air_is_that_of_the_standard(height, pascals, celsius):
    assert sensors.pressure(height) == pytest.approx(pascals, rel=1e-5)
    assert sensors.temperature(height) == pytest.approx(celsius, abs=1e-6)
    assert sensors.pressure_altitude(pascals) == pytest.approx(height, abs=0.1)


def ecef(latitude, longitude, altitude):
    a, b = 6378137.0, 6356752.314245  # WGS 84
    phi, lam = np.radians([latitude, longitude])
    n = a * a / np.hypot(a * np.cos(phi), b * np.sin(phi))
    across = (n + altitude) * np.cos(phi)
    return np.array([across * np.cos(lam), across * np.sin(lam), (b * b / (a * a) * n + altitude) * np.sin(phi)])


@pytest.mark.parametrize("home", [(47.397742, 8.545594, 488.0), (-33.9, 151.2, 20.0), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("point", [(100.0, 0.0, 0.0), (0.0, 100.0, 0.0), (-30.0, 70.0, 12.0)])
def test_a_place_is_as_far_east_north_and_up_as_it_says(home, point):
    found = sensors.place(Home(*home), Vec3(*point))
    phi, lam = np.radians(home[:2])
    east = np.array([-np.sin(lam), np.cos(lam), 0.0])
    up = np.array([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])
    north = np.cross(up, east)
    moved = ecef(*found) - ecef(*home)
    assert [moved @ axis for axis in (east, north, up)] == pytest.approx(point, abs=5e-3)


def test_the_field_points_north_and_into_the_ground_in_europe():
    home = Home(field_strength=0.5, field_declination=90.0, field_inclination=0.0)
    assert sensors.magnetic_field(home) == pytest.approx((0.5, 0.0, 0.0), abs=1e-12)  # east
    home = Home(field_strength=0.5, field_declination=0.0, field_inclination=60.0)
    assert sensors.magnetic_field(home) == pytest.approx((0.0, 0.25, -0.5 * np.sqrt(0.75)), abs=1e-12)


INERTIAL = Inertial(rate=Vec3(0.1, 0.2, 0.3), force=Vec3(1.0, 2.0, -9.8))


def test_a_sensor_message_marks_what_is_new():
    found = sensors.sensor_fields(4000, INERTIAL, None, None)
    assert found[:7] == (4000, 1.0, 2.0, -9.8, 0.1, 0.2, 0.3)
    assert found[-1] == 0x3F
    found = sensors.sensor_fields(8000, INERTIAL, Vec3(0.2, 0.0, 0.4), Air(95_460.0, 500.0, 11.75))
    assert found[7:14] == pytest.approx((0.2, 0.0, 0.4, 954.6, 0.0, 500.0, 11.75))
    assert found[-1] == 0x3F | 0x1C0 | 0x1A00  # xyz of three sensors, pressure, its altitude, temperature


def test_a_fix_is_in_whole_small_units():
    found = sensors.gps_fields(100_000, Fix(Place(47.397742, -8.545594, 488.1234), Vec3(3.0, -4.0, 0.5)))
    assert found[:5] == (100_000, 3, 473_977_420, -85_455_940, 488_123)
    assert found[7:11] == (500, 300, -400, 50)
    assert found[11] == pytest.approx(100.0 * (360.0 - np.degrees(np.arctan2(4.0, 3.0))), abs=1)
    assert sensors.gps_fields(0, Fix(Place(0.0, 0.0, 0.0), Vec3(0.1, 0.0, 0.0)))[11] == 65535
    assert 0 <= sensors.gps_fields(0, Fix(Place(0.0, 0.0, 0.0), Vec3(9.0, -1e-9, 0.0)))[11] < 36000
    assert sensors.gps_fields(0, Fix(Place(0.0, 0.0, 0.0), Vec3(900.0, 0.0, -900.0)))[7:11] == (32767, 32767, 0, -32767)


def test_truth_is_frd_in_ned():
    yaw, roll = np.radians(30.0), 0.2  # of FLU in ENU: nose 60 degrees east of north
    q = Quat(*Rotation.from_euler("ZYX", (yaw, 0.0, roll)).as_quat().tolist())
    state = VehicleState(Vec3(), Vec3(1.0, 2.0, 3.0), q, Vec3(0.1, 0.2, 0.3))
    found = sensors.truth_fields(4000, state, Place(1.0, 2.0, 3.0), Vec3(1.0, 2.0, 0.0), Vec3(0.0, 0.0, -9.80665))
    w, x, y, z = found[1]
    heading, pitch, bank = Rotation.from_quat([x, y, z, w]).as_euler("ZYX", degrees=True)
    assert (heading, pitch, bank) == pytest.approx((60.0, 0.0, np.degrees(roll)), abs=1e-6)
    assert found[2:5] == pytest.approx((0.1, -0.2, -0.3))
    assert found[5:8] == (10_000_000, 20_000_000, 3000)
    assert found[8:13] == (200, 100, -300, 300, 300)
    assert found[13:] == (0, 0, -1000)


CALM = Vec3(0.0, 0.0, 0.0)
PERIOD = 4_000_000  # ns


def high(z):
    return VehicleState(Vec3(0.0, 0.0, z), CALM, Quat(0.0, 0.0, 0.0, 1.0), CALM)


DEFAULT = Sensors()


def readings(count, parameters=DEFAULT, seed=1):
    suite = Suite(parameters, seed, PERIOD, 9.81)
    return [suite.read(high(1.0), CALM) for _ in range(count)]


def test_the_clock_goes_in_whole_periods_and_each_sensor_is_read_at_its_own_pace():
    found = readings(300)
    assert [reading.sensor[0] for reading in found] == [4000 * (k + 1) for k in range(300)]
    assert {reading.gps[0] for reading in found if reading.gps} == {100_000 * (k + 1) for k in range(12)}
    assert sum(bool(reading.sensor[-1] & 0x1C0) for reading in found) == 300 // 4
    assert sum(bool(reading.sensor[-1] & 0x1A00) for reading in found) == 300 // 5
    assert sum(reading.truth is not None for reading in found) == 300 // 5
    assert all(reading.sensor[-1] & 0x3F == 0x3F for reading in found)


def test_a_fix_is_as_old_as_its_delay():
    suite = Suite(QUIET._replace(gps_steps=1, gps_delay=0.1), 1, PERIOD, 9.81)
    heights = [suite.read(high(float(k)), CALM).gps[4] / 1000.0 - 488.0 for k in range(100)]
    assert heights[60:] == [k - 25.0 for k in range(60, 100)]  # 0.1 s of 4 ms
    assert heights[0] == 0.0  # none is older than the first


def test_the_error_of_a_fix_grows_with_the_time_between_fixes():
    def wander(period_steps):
        suite = Suite(Sensors(gps_walk=0.0, gps_steps=period_steps), 1, PERIOD, 9.81)
        fixes = [fix for _ in range(20_000) if (fix := suite.read(high(0.0), CALM).gps)]
        return np.diff([fix[4] / 1000.0 for fix in fixes]).std()

    assert wander(25) == pytest.approx(0.4 * np.sqrt(0.1), rel=0.1)


def test_a_magnetometer_read_less_often_is_no_noisier_than_its_density():
    parameters = Sensors(magnetometer=Noise(4e-4), magnetometer_steps=10)
    found = [reading.sensor[7] for reading in readings(20_000, parameters)[9::10]]
    assert np.std(found) == pytest.approx(4e-4 / np.sqrt(0.04), rel=0.1)


def test_equal_seeds_read_equally_and_noise_never_repeats():
    first = np.array([reading.sensor[1:7] for reading in readings(500)])
    assert np.array_equal(first, [reading.sensor[1:7] for reading in readings(500)])
    assert not np.array_equal(first[:10], [reading.sensor[1:7] for reading in readings(10, seed=2)])
    assert len(np.unique(first[:, 3])) == 500


def test_the_first_reading_feels_no_jump_from_nothing():
    moving = high(1.0)._replace(v_w=Vec3(5.0, 0.0, 0.0))
    assert abs(Suite(Sensors(), 1, PERIOD, 9.81).read(moving, CALM).sensor[1]) < 1.0


def test_a_period_that_is_no_whole_microsecond_is_refused():
    with pytest.raises(ParameterError, match=r"flight\.plant_period: found 4000500 ns"):
        Suite(Sensors(), 1, 4_000_500, 9.81)
