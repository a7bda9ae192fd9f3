"""What the simulator publishes for tools, and when it draws."""

import pytest
from nav_msgs.msg import Odometry

from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_dynamics.node import Simulator, fill


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
