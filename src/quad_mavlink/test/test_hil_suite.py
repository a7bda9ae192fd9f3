"""When each sensor is read, by which clock, and how late a fix is."""

import numpy as np
import pytest

from quad_core.parameters import ParameterError
from quad_core.types import Quat, Vec3, VehicleState
from quad_mavlink.hil import sensors
from quad_mavlink.hil.parameters import GpsParameters, JoinedPlantParameters, MagnetometerParameters
from quad_mavlink.hil.suite import Suite

CALM = Vec3(0.0, 0.0, 0.0)
PERIOD = 4_000_000  # ns
CERTAIN = GpsParameters(walk=0.0, vertical_walk=0.0, velocity_noise=0.0)


def high(z):
    return VehicleState(Vec3(0.0, 0.0, z), CALM, Quat(0.0, 0.0, 0.0, 1.0), CALM)


DEFAULT = JoinedPlantParameters()


def readings(count, parameters=DEFAULT, seed=1):
    suite = Suite(parameters, seed, PERIOD, 9.81)
    return [suite.read(high(1.0), CALM) for _ in range(count)]


def test_the_clock_begins_one_period_after_0_and_goes_in_whole_periods():
    found = readings(300)
    assert [reading.sensor[0] for reading in found] == [4000 * (k + 1) for k in range(300)]
    assert {reading.gps[0] for reading in found if reading.gps} == {100_000 * (k + 1) for k in range(12)}


def test_each_sensor_is_read_at_its_own_pace():
    found = readings(300)
    assert sum(bool(reading.sensor[-1] & 0x1C0) for reading in found) == 300 // 4
    assert sum(bool(reading.sensor[-1] & 0x1A00) for reading in found) == 300 // 5
    assert sum(reading.truth is not None for reading in found) == 300 // 5
    assert all(reading.sensor[-1] & 0x3F == 0x3F for reading in found)


def test_a_fix_is_as_old_as_its_delay():
    parameters = JoinedPlantParameters(gps=CERTAIN._replace(period_steps=1, delay=0.1))
    suite = Suite(parameters, 1, PERIOD, 9.81)
    heights = [suite.read(high(float(k)), CALM).gps[4] / 1000.0 - 488.0 for k in range(100)]
    assert heights[60:] == [k - 25.0 for k in range(60, 100)]  # 0.1 s of 4 ms
    assert heights[0] == 0.0  # none is older than the first


def test_the_error_of_a_fix_grows_with_the_time_between_fixes():
    def wander(period_steps):
        gps = GpsParameters(walk=0.0, vertical_walk=0.4, period_steps=period_steps)
        suite = Suite(JoinedPlantParameters(gps=gps), 1, PERIOD, 9.81)
        fixes = [fix for _ in range(20_000) if (fix := suite.read(high(0.0), CALM).gps)]
        return np.diff([fix[4] / 1000.0 for fix in fixes]).std()

    assert wander(25) == pytest.approx(0.4 * np.sqrt(0.1), rel=0.1)


def test_a_magnetometer_read_less_often_is_no_noisier_than_its_density():
    parameters = JoinedPlantParameters(magnetometer=MagnetometerParameters(period_steps=10, bias_walk=0.0))
    found = [reading.sensor[7] for reading in readings(20_000, parameters)[9::10]]
    assert np.std(found) == pytest.approx(4e-4 / np.sqrt(0.04), rel=0.1)


def test_equal_seeds_read_equally_and_noise_never_repeats():
    long = sensors.BLOCK + 500
    first = np.array([reading.sensor[1:7] for reading in readings(long)])
    assert np.array_equal(first, [reading.sensor[1:7] for reading in readings(long)])
    assert not np.array_equal(first[:10], [reading.sensor[1:7] for reading in readings(10, seed=2)])
    noise = first - first.mean(axis=0)
    assert abs(np.corrcoef(noise[:400, 3], noise[sensors.BLOCK : sensors.BLOCK + 400, 3])[0, 1]) < 0.2


def test_the_first_reading_feels_no_jump_from_nothing():
    moving = high(1.0)._replace(v_w=Vec3(5.0, 0.0, 0.0))
    assert abs(Suite(JoinedPlantParameters(), 1, PERIOD, 9.81).read(moving, CALM).sensor[1]) < 1.0


def test_a_period_that_is_no_whole_microsecond_is_refused():
    with pytest.raises(ParameterError, match=r"flight\.plant_period: found 4000500 ns"):
        Suite(JoinedPlantParameters(), 1, 4_000_500, 9.81)
