"""What the simulator publishes for tools, and when it draws."""

import time
from types import SimpleNamespace

import pytest
from nav_msgs.msg import Odometry

from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_dynamics.node import Simulator, fill
from quad_msgs.msg import FlightState
from quad_node.codec import Stamped


def test_a_mission_in_real_time_draws_nothing_for_half_an_hour(start_node, monkeypatch):
    roles = "simulator,trajectory,commander,position_controller,attitude_controller,recorder"
    model = start_node(Simulator, f"flight.roles:={roles}", "flight.mode:=realtime").model
    monkeypatch.setattr(model, "cover", lambda steps: pytest.fail(f"drawn in flight: {steps} steps"))
    for second in (120, 240, 1799):
        model.advance(500 * second, Wrench())


def test_odom_has_the_pose_in_map_and_the_twist_in_base_link():
    turned_left = Quat(0.0, 0.0, 0.5**0.5, 0.5**0.5)
    state = VehicleState(Vec3(1.0, 2.0, 3.0), Vec3(4.0, 5.0, 6.0), turned_left, Vec3(7.0, 8.0, 9.0))
    found = fill(Odometry(), state, 3_000_000_007)
    assert (found.header.frame_id, found.child_frame_id) == ("map", "base_link")
    assert (found.header.stamp.sec, found.header.stamp.nanosec) == (3, 7)
    pose, twist = found.pose.pose, found.twist.twist
    assert (pose.position.x, pose.position.y, pose.position.z) == (1.0, 2.0, 3.0)
    assert (pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w) == turned_left
    assert [round(part, 12) for part in (twist.linear.x, twist.linear.y, twist.linear.z)] == [5.0, -4.0, 6.0]
    assert (twist.angular.x, twist.angular.y, twist.angular.z) == (7.0, 8.0, 9.0)


@pytest.fixture
def late(start_node, monkeypatch):
    """Return ``late(steps, *parameters)``: a simulator in real time at the tick that finds so many steps due."""

    def make(steps, *parameters):
        simulator = start_node(Simulator, "flight.mode:=realtime", *parameters)
        simulator.leader.phase = FlightState.FLYING
        monkeypatch.setattr(simulator, "_publish_step", lambda: None)
        monkeypatch.setattr(time, "monotonic", lambda: 100.0)
        simulator._clock_start = 100.0 - (simulator.node.current_step + steps + 0.5) * simulator._period * 1e-9
        return simulator

    return make


@pytest.mark.parametrize(("steps", "expected"), [(1, ""), (2, "simulator stood still for 0.04 s")])
def test_a_tick_that_is_not_late_is_no_pause_however_long_the_period(late, steps, expected):
    simulator = late(steps, "flight.plant_period:=40000000")
    simulator._on_period()
    assert (simulator.node.current_step, simulator.leader.stood_still) == (steps, expected)


@pytest.mark.parametrize(("newest", "missed"), [(4, 0), (2, 1)])
def test_a_controller_with_a_longer_period_misses_no_step_between_its_own(late, monkeypatch, newest, missed):
    simulator = late(1)
    monkeypatch.setattr(simulator.leader.handshake, "period", lambda role: 2)
    simulator.node.current_step, simulator._clock_start = 5, 100.0 - 6.5 * simulator._period * 1e-9
    simulator.leader.wrenches.newest = Stamped(newest, newest + 1, 0, Wrench(5.0), True)
    simulator.leader.wrenches.at = 100.0
    simulator._on_period()
    assert simulator.leader.wrenches.missed == missed


def test_odom_and_clock_come_after_steps_that_were_caught_up_with(start_node, monkeypatch):
    simulator = start_node(Simulator, "flight.mode:=realtime", "odom_period_steps:=10", "clock_period_steps:=5")
    monkeypatch.setattr(simulator, "_send", lambda *_: None)
    sent = {"_odom_out": [], "_clock_out": []}
    for name, steps in sent.items():
        note = SimpleNamespace(publish=lambda _, steps=steps: steps.append(simulator.node.current_step))
        monkeypatch.setattr(simulator, name, note)
    for simulator.node.current_step in (0, 1, 3, 7, 9, 11, 23):
        simulator._publish_step()
    assert sent == {"_odom_out": [0, 11, 23], "_clock_out": [0, 7, 11, 23]}
