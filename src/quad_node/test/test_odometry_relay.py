"""Odometry of REP 105 (twist in the body frame) as the state that the controllers see."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from scipy.spatial.transform import Rotation

from quad_core.estimator import Estimator
from quad_core.types import Actuation
from quad_msgs.msg import Actuation as ActuationMsg
from quad_msgs.msg import FlightState, VehicleState
from quad_node import odometry_relay
from quad_node.codec import packer
from quad_node.odometry_relay import OdometryRelay, sample_of

BEGUN = FlightState(state=FlightState.FLYING)


def odometry(q, v_b=(0.0, 0.0, 0.0), scale=1.0):
    message = Odometry()
    orientation, twist = message.pose.pose.orientation, message.twist.twist
    linear, angular = twist.linear, twist.angular
    orientation.x, orientation.y, orientation.z, orientation.w = (float(scale * part) for part in q)
    message.pose.pose.position.x, message.pose.pose.position.z = 1.5, -2.0
    linear.x, linear.y, linear.z = map(float, v_b)
    angular.x, angular.y, angular.z = 0.1, -0.2, 0.3
    return message


def state_from_odometry(message):
    """Return what a first message in flight becomes, None if it is no sample."""
    sample = sample_of(message, 0, 0.0)
    return None if sample is None else Estimator("odom", 2_000_000, False, True, 0.0).take(sample)[1]


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


@pytest.fixture
def relay(monkeypatch, start_node):
    """A relay whose clock, `now` (s), the test sets: the relay's limits are shorter than a machine may stand still."""
    made = start_node(OdometryRelay, "odometry:=est/odom", "flight.mode:=realtime")
    made.sent, made.said, made.now = [], [], 100.0
    monkeypatch.setattr(odometry_relay, "time", SimpleNamespace(monotonic=lambda: made.now))
    made._state_out = SimpleNamespace(
        publish=lambda payload: made.sent.append(deserialize_message(payload, VehicleState))
    )
    for name in ("info", "warn", "error"):
        monkeypatch.setattr(made.node.events, name, lambda kind, text, *_, **__: made.said.append((kind, text)))
    return made


def message_at(ns, frame="map", child="base_link", q=(0.0, 0.0, 0.0, 1.0)):
    message = odometry(q)
    message.pose.pose.position.y = 1e-9 * ns
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, 10**9)
    message.header.frame_id, message.child_frame_id = frame, child
    return message


def test_before_the_flight_nothing_is_sent_and_in_it_steps_on_the_grid(relay):
    for ns in (0, 0, 0):
        relay.step(message_at(ns))
    assert relay.sent == []
    relay.node._on_flight_state(BEGUN)
    relay._watch()
    for ns in (0, 2_000_700, 4_000_001, 2_000_700):
        relay.step(message_at(ns))
    assert [state.step for state in relay.sent] == [0, 1, 2], "one state for each step"
    assert [state.stamp.nanosec for state in relay.sent] == [0, 2_000_000, 4_000_000]
    # it stands where it was first seen
    assert all(state.on_ground and state.ground_z == -2.0 for state in relay.sent)
    assert relay._measured()["swapped_samples"] == 1


@pytest.mark.parametrize(("changes", "why"), [
    ({"frame": "odom"}, "est/odom: frame 'odom', expected 'map'"),
    ({"child": "imu"}, "est/odom: frame 'imu', expected 'base_link'"),
    ({"q": (0.0, 0.0, 0.0, 0.0)}, "est/odom: a quaternion that is not of length 1"),
])  # fmt: skip
def test_what_cannot_be_used_is_named_and_after_five_seconds_the_end(relay, changes, why):
    relay.step(message_at(0, **changes))
    assert relay.said == [("rejected_odometry", f"{why}; message ignored")]
    assert not relay.node.done.done()
    relay.now += 6.0
    relay._watch()
    assert relay.said[-1] == ("estimator_refused", why)
    assert relay.node.done.done()
    assert relay.node.exit_code == 1


@pytest.mark.parametrize("kinds", [["estimator_reset"], ["wrong_twist", "wrong_twist"]])
def test_what_the_estimator_says_has_the_time_of_the_flight_and_each_part_of_a_wrong_twist_is_said(
    relay, kinds, monkeypatch
):
    said = []
    for name in ("info", "warn", "error"):
        monkeypatch.setattr(relay.node.events, name, getattr(type(relay.node.events), name).__get__(relay.node.events))
    monkeypatch.setattr(relay.node.events, "_out", SimpleNamespace(publish=said.append))
    relay.node.flying, relay.node.current_step = True, 50
    relay.estimator.news.extend((kind, f"part {number}") for number, kind in enumerate(kinds))
    relay._relay(sample_of(message_at(1_764_000_000 * 10**9), 1_764_000_000 * 10**9, relay.now), relay.now)
    assert [event.kind for event in said[: len(kinds)]] == kinds
    assert {(event.stamp.sec, event.stamp.nanosec) for event in said} == {(0, 100_000_000)}


def test_a_pose_from_which_no_flyable_state_comes_is_counted(relay):
    """Two poses 2 us apart in the steps 1 and 2: the slope between them is 5 km/s."""
    relay.node.flying = True
    for ns, x in ((2_999_999, 0.0), (3_000_001, 0.01)):
        pose = PoseStamped()
        pose.header.frame_id, pose.header.stamp.nanosec, pose.pose.position.x = "map", ns, x
        relay.step(pose)
    assert [state.step for state in relay.sent] == [1]
    assert relay.node.events.counts["rejected"] == 1
    assert relay.said == [("rejected_odometry", "est/odom: its state is out of range; message ignored")]


def test_an_estimator_that_is_late_in_flight_is_named(relay):
    relay.step(message_at(0))
    relay.node._on_flight_state(BEGUN)
    relay._watch()
    relay.step(message_at(2_000_000))
    assert relay.said == []
    relay.now += 0.088
    relay.step(message_at(90_000_000))
    assert relay.said == [("estimator_late", "est/odom: nothing for 88 ms")]


def test_an_estimator_that_falls_silent_in_flight_is_named(relay):
    relay.step(message_at(0))
    relay.node.flying = True
    relay.step(message_at(0))
    relay.step(message_at(2_000_000))
    relay._watch()
    assert not relay.node.done.done()
    relay.now, relay.node.slept = relay.now + 0.3, 0.3
    relay._watch()
    assert not relay.node.done.done()  # it stood still itself: what the estimator sent is still to be read
    relay.node.slept = 0.0
    relay._watch()
    assert relay.said[-1] == ("estimator_silent", "est/odom: silent since 0.002 s")
    assert relay.node.exit_code == 1


@pytest.mark.parametrize("lockstep", [True, False])
def test_an_estimator_that_repeats_its_last_pose_is_named(relay, lockstep):
    relay.estimator = Estimator("est/odom", 2_000_000, False, lockstep, 0.0)
    relay.node.lockstep = lockstep
    relay.node.flying = True
    for k in range(200):
        message = message_at(min(k, 20) * 2_000_000)
        message.header.stamp.nanosec = k * 2_000_000
        relay.step(message)
    relay.now += 0.3
    relay._watch()
    assert relay.said[0] == ("estimator_silent", "est/odom: the same pose since 0.040 s")
    assert relay.node.exit_code == 1
    assert [state.step for state in relay.sent] == list(range(146 if lockstep else 21))


@pytest.mark.parametrize(("stamps", "places", "why"), [
    ((0, 0, 0, 0), (0, 1, 2, 3), "its stamps do not advance"),
    ((0, 1, 2, 3), (0, 0, 0, 0), "the same pose"),
])  # fmt: skip
def test_an_estimate_that_stands_as_the_flight_begins_is_named_before_the_guard_ends_it(relay, stamps, places, why):
    relay.node.flying = True
    for stamp, place in zip(stamps, places, strict=True):
        relay.step(moved(message_at(2_000_000 * stamp), place))
        assert not relay.node.done.done()
    relay.now += 0.04
    relay.step(moved(message_at(2_000_000 * stamps[-1]), places[-1]))
    assert relay.said[-1] == ("estimator_silent", f"est/odom: {why} since 0.000 s")
    assert relay.node.exit_code == 1


def moved(message, place):
    message.pose.pose.position.y = 0.01 * place
    return message


def test_a_stall_in_flight_is_given_time(relay):
    relay.node.flying = True
    for k in range(200):
        relay.step(message_at(2_000_000 * k))
    relay.now += 0.04
    relay.step(moved(message_at(2_000_000 * 199), 7))
    assert not relay.node.done.done()


def test_a_type_that_is_not_taken_is_named_and_after_five_seconds_the_end(relay, monkeypatch):
    kind = SimpleNamespace(topic_type="geometry_msgs/msg/PoseWithCovarianceStamped")
    monkeypatch.setattr(relay.node.ros, "get_publishers_info_by_topic", lambda _: [kind])
    details = []
    monkeypatch.setattr(relay.node, "publish_status", details.append)
    why = "est/odom: found geometry_msgs/msg/PoseWithCovarianceStamped, expected nav_msgs/msg/Odometry or "
    why += "geometry_msgs/msg/PoseStamped"
    assert relay.node.missing()[-1] == relay.node.missing()[-1] == why
    assert details == [why], "shown once while the flight waits"
    relay.now += 6.0
    relay._watch()
    assert relay.said == [("estimator_refused", why)]


def test_a_second_estimator_on_the_topic_is_named(relay, monkeypatch):
    relay.step(message_at(0))
    assert "upright" not in relay._unusable()
    info = SimpleNamespace(node_namespace="/", node_name="mocap")
    monkeypatch.setattr(relay.node.ros, "count_publishers", lambda _: 2)
    monkeypatch.setattr(relay.node.ros, "get_publishers_info_by_topic", lambda _: [info, info])
    assert relay._unusable() == "one publisher of est/odom, there are 2: /mocap (2 times)"


def test_a_wrong_pose_is_told_by_the_actuation_and_ends_the_relay(relay):
    """Turned by half a turn about the vertical, the vehicle leans to one side and goes to the other."""
    relay.node.flying, lean = True, Rotation.from_euler("y", 20.0, degrees=True).as_quat()
    pack = packer(Actuation, ActuationMsg, relay.node.run)
    thrust = relay.node.vehicle.mass * relay.node.vehicle.gravity / math.cos(math.radians(20.0))
    push = relay.node.vehicle.gravity * math.tan(math.radians(20.0))
    for k in range(600):
        time = 0.002 * k
        relay._on_actuation(pack(Actuation(thrust=thrust), k, k + 1, 2_000_000 * k))
        pose = PoseStamped()
        pose.header.frame_id = "map"
        pose.header.stamp.sec, pose.header.stamp.nanosec = divmod(2_000_000 * k, 10**9)
        pose.pose.position.x = -0.5 * push * time * time
        orientation = pose.pose.orientation
        orientation.x, orientation.y, orientation.z, orientation.w = map(float, lean)
        relay.step(pose)
        if relay.node.done.done():
            break
    kind, text = relay.said[-1]
    assert kind == "wrong_pose"
    assert "a heading that is off by 180 deg" in text.replace("-180", "180")
    assert relay.node.exit_code == 1
    assert relay.sent[-1].step < 500


def test_an_estimator_whose_z_points_down_ends_at_lift_off(relay):
    relay.step(message_at(0))
    relay.node._on_flight_state(BEGUN)
    relay._watch()
    for step in range(1, 100):
        message = odometry((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
        message.pose.pose.position.z -= 0.002 * step
        message.header.frame_id, message.child_frame_id = "map", "base_link"
        message.header.stamp.nanosec = 2_000_000 * step
        relay.step(message)
    text = "est/odom: sinks at lift-off, found -1.0 m/s: expected a z axis that points up"
    assert ("estimator_sinks", text) in relay.said
    assert relay.node.exit_code == 1
    assert len(relay.sent) < 60


def test_a_pose_alone_is_a_sample_without_twist():
    pose = PoseStamped()
    pose.pose.orientation.w, pose.pose.position.x = 1.0, 3.0
    found = sample_of(pose, 5, 0.1)
    assert (found.stamp_ns, found.p_w.x, found.twist_linear, found.twist_angular) == (5, 3.0, None, None)
