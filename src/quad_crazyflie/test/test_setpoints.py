"""The manual setpoint points the thrust where it was asked for, at any heading."""

import math

import numpy as np
import pytest
from frames_oracle import BODY, WORLD
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quad_autopilot import odometry
from quad_core.types import AttitudeThrust, Quat, Vec3, VehicleState
from quad_crazyflie import setpoints
from quad_crazyflie.parameters import CrazyflieBridgeParameters

SETTINGS = CrazyflieBridgeParameters(max_rotor_thrust=0.15, tilt_limit=1.0)
angles = st.floats(-0.6, 0.6)
headings = st.floats(-3.0, 3.0)


def quaternion(rotation):
    return Quat(*rotation.as_quat().tolist())


def at(yaw):
    q = quaternion(Rotation.from_euler("z", yaw))
    return VehicleState(Vec3(0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0), q, Vec3(0.0, 0.0, 0.0))


def direction(found, yaw):
    """Return where the thrust points (ENU) for angles in FLU: pitch > 0 nose down, roll > 0 right side down."""
    tilt = Rotation.from_euler("ZYX", [yaw, math.radians(found.pitch), math.radians(found.roll)])
    return tilt.apply([0.0, 0.0, 1.0])


@given(headings, headings, angles, angles)
def test_the_thrust_points_where_it_should_whatever_the_heading(now, desired, pitch, roll):
    target = Rotation.from_euler("ZYX", [desired, pitch, roll])
    found = setpoints.manual(SETTINGS, AttitudeThrust(q_wb=quaternion(target), thrust=0.3), at(now))
    assert direction(found, now) == pytest.approx(target.apply([0.0, 0.0, 1.0]), abs=1e-6)
    error = math.remainder(desired - now, 2.0 * math.pi)
    limited = max(-3.0, min(3.0, 3.0 * error))
    assert math.radians(found.yaw_rate) == pytest.approx(limited, abs=1e-6)


@given(st.floats(0.16, 0.9), st.floats(0.0, 1.0))
def test_the_thrust_of_16_bits_is_that_of_the_motors_curve(share, curve):
    settings = SETTINGS._replace(thrust_curve=curve)
    setpoint = AttitudeThrust(q_wb=Quat(0.0, 0.0, 0.0, 1.0), thrust=share * 0.6)
    percent = setpoints.manual(settings, setpoint, at(0.0)).percent
    u = (10001 + 0.01 * percent * (60000 - 10001)) / 65535
    if 0.0 < percent < 100.0:
        assert curve * u * u + (1.0 - curve) * u == pytest.approx(share, abs=1e-6)


def test_limits_are_met():
    steep = Rotation.from_euler("ZYX", [0.0, 1.2, 0.0])
    found = setpoints.manual(
        SETTINGS._replace(tilt_limit=0.5), AttitudeThrust(q_wb=quaternion(steep), thrust=9.0), at(0.0)
    )
    assert (found.pitch, found.percent) == (pytest.approx(math.degrees(0.5)), 100.0)
    assert setpoints.largest_thrust(SETTINGS) == pytest.approx(0.6 * 60000 / 65535)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_a_log_block_arrives_as_the_state_that_was_packed(parts):
    q = np.array(parts) / np.linalg.norm(parts)
    largest = int(np.argmax(np.abs(q)))
    q = q * np.sign(q[largest])
    bits = largest
    for place in (each for each in range(4) if each != largest):
        bits = bits << 10 | int(q[place] < 0.0) << 9 | int(511 * abs(q[place]) * math.sqrt(2.0) + 0.5)
    numbers = {
        "x": 1000,
        "y": -2000,
        "z": 500,
        "vx": 10,
        "vy": 20,
        "vz": -30,
        "rateRoll": 100,
        "ratePitch": 200,
        "rateYaw": -300,
    }
    block = {f"stateEstimateZ.{name}": value for name, value in numbers.items()} | {"stateEstimateZ.quat": bits}
    sample = setpoints.sample(1234, block)
    assert odometry.refusal(sample, -1) == ""
    state = odometry.state(sample)
    assert state.p_w == pytest.approx((1.0, -2.0, 0.5))
    assert state.v_w == pytest.approx((0.01, 0.02, -0.03))
    assert state.omega_b == pytest.approx((0.1, -0.2, -0.3))
    assert (Rotation.from_quat(state.q_wb).inv() * Rotation.from_quat(q)).magnitude() < 0.01
    assert sample.timestamp_sample == 1_234_000
    assert np.array(sample.position) == pytest.approx(WORLD @ state.p_w)
    assert np.array(sample.angular_velocity) == pytest.approx(BODY @ state.omega_b)
