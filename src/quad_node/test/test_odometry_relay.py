"""Odometry of REP 105 (twist in the body frame) as the state that the controllers see."""

import math

import numpy as np
import pytest
import rclpy
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from scipy.spatial.transform import Rotation

from quad_msgs.msg import VehicleState
from quad_node import executor
from quad_node.odometry_relay import OdometryRelay, state_from_odometry


def odometry(q, v_b=(0.0, 0.0, 0.0), scale=1.0):
    message = Odometry()
    orientation, linear, angular = (
        message.pose.pose.orientation,
        message.twist.twist.linear,
        message.twist.twist.angular,
    )
    orientation.x, orientation.y, orientation.z, orientation.w = (float(scale * part) for part in q)
    message.pose.pose.position.x, message.pose.pose.position.z = 1.5, -2.0
    linear.x, linear.y, linear.z = map(float, v_b)
    angular.x, angular.y, angular.z = 0.1, -0.2, 0.3
    return message


@pytest.mark.parametrize("seed", range(5))
def test_velocity_is_turned_into_the_world(seed):
    rng = np.random.default_rng(seed)
    attitude = Rotation.random(random_state=seed)
    v_b = rng.normal(size=3)
    state = state_from_odometry(odometry(attitude.as_quat(), v_b))
    assert np.allclose(state.v_w, attitude.apply(v_b), rtol=0, atol=1e-14)
    assert np.allclose(state.q_wb, attitude.as_quat(), rtol=0, atol=1e-15)
    assert state.p_w == (1.5, 0.0, -2.0)
    assert state.omega_b == (0.1, -0.2, 0.3)


def test_a_quaternion_of_single_precision_is_normalised():
    state = state_from_odometry(odometry((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)), (1.0, 0.0, 0.0), scale=1.0 + 1e-6))
    assert math.isclose(sum(part * part for part in state.q_wb), 1.0, abs_tol=1e-15)
    assert np.allclose(state.v_w, (0.0, 1.0, 0.0), atol=1e-15)


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)])
def test_without_an_attitude_there_is_no_state(q):
    assert state_from_odometry(odometry(q)) is None


class Wire:
    """Stands in for a publisher and keeps the stamps in s of the states that were sent."""

    def __init__(self):
        self.sent = []

    def publish(self, payload):
        self.sent.append(deserialize_message(payload, VehicleState).stamp.sec)


@pytest.fixture
def relay(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "75")
    executor.init(["--ros-args", "-p", "stamps:=first"])
    made = OdometryRelay()
    made._state_out = Wire()
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


def test_no_stamp_ends_the_relay_and_one_before_all_time_is_no_beginning(relay):
    for sec in (-(2**31), -1, 10, 12, 9, 2**31 - 1):
        message = odometry((0.0, 0.0, 0.0, 1.0))
        message.header.stamp.sec, message.header.frame_id, message.child_frame_id = sec, "map", "base_link"
        relay._on_odometry(message)
    assert relay._state_out.sent == [0, 2, 2**31 - 1 - 10]
    assert relay.counters["stamp_backwards"] == 3
