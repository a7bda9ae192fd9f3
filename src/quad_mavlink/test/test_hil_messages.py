"""Units, order and marks of the three messages, against MAVLink's own definition."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_core.types import Quat, Vec3, VehicleState
from quad_mavlink.hil import messages
from quad_mavlink.hil.earth import Place
from quad_mavlink.hil.sensors import Air, Fix, Inertial

INERTIAL = Inertial(rate=Vec3(0.1, 0.2, 0.3), force=Vec3(1.0, 2.0, -9.8))


def test_a_sensor_message_marks_what_is_new():
    found = messages.sensor(4000, INERTIAL, None, None)
    assert found[:7] == (4000, 1.0, 2.0, -9.8, 0.1, 0.2, 0.3)
    assert found[-1] == 0x3F
    found = messages.sensor(8000, INERTIAL, Vec3(0.2, 0.0, 0.4), Air(95_460.0, 500.0, 11.75))
    assert found[7:14] == pytest.approx((0.2, 0.0, 0.4, 954.6, 0.0, 500.0, 11.75))
    assert found[-1] == 0x3F | 0x1C0 | 0x1A00  # xyz of three sensors, pressure, its altitude, temperature


def test_a_fix_is_in_whole_small_units():
    found = messages.gps(100_000, Fix(Place(47.397742, -8.545594, 488.1234), Vec3(3.0, -4.0, 0.5)))
    assert found[:5] == (100_000, 3, 473_977_420, -85_455_940, 488_123)
    assert found[7:11] == (500, 300, -400, 50)
    assert found[11] == pytest.approx(100.0 * (360.0 - np.degrees(np.arctan2(4.0, 3.0))), abs=1)
    assert messages.gps(0, Fix(Place(0.0, 0.0, 0.0), Vec3(0.1, 0.0, 0.0)))[11] == 65535
    assert 0 <= messages.gps(0, Fix(Place(0.0, 0.0, 0.0), Vec3(9.0, -1e-9, 0.0)))[11] < 36000
    assert messages.gps(0, Fix(Place(0.0, 0.0, 0.0), Vec3(900.0, 0.0, -900.0)))[7:11] == (32767, 32767, 0, -32767)


def test_truth_is_frd_in_ned():
    yaw, roll = np.radians(30.0), 0.2  # of FLU in ENU: nose 60 degrees east of north
    q = Quat(*Rotation.from_euler("ZYX", (yaw, 0.0, roll)).as_quat().tolist())
    state = VehicleState(Vec3(), Vec3(1.0, 2.0, 3.0), q, Vec3(0.1, 0.2, 0.3))
    found = messages.truth(4000, state, Place(1.0, 2.0, 3.0), Vec3(1.0, 2.0, 0.0), Vec3(0.0, 0.0, -9.80665))
    w, x, y, z = found[1]
    heading, pitch, bank = Rotation.from_quat([x, y, z, w]).as_euler("ZYX", degrees=True)
    assert (heading, pitch, bank) == pytest.approx((60.0, 0.0, np.degrees(roll)), abs=1e-6)
    assert found[2:5] == pytest.approx((0.1, -0.2, -0.3))
    assert found[5:8] == (10_000_000, 20_000_000, 3000)
    assert found[8:13] == (200, 100, -300, 300, 300)
    assert found[13:] == (0, 0, -1000)
