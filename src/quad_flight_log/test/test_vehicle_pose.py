"""The poses that the recorder gives standard tools, against the messages that they are made of."""

import json
import math
from pathlib import Path
from unittest.mock import MagicMock

import flight_samples
import numpy as np
import pytest
from ament_index_python.packages import get_package_share_directory
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TransformStamped
from scipy.spatial.transform import Rotation

from quad_core.types import Quat, TrajectoryPoint, Vec3, VehicleState
from quad_flight_log.vehicle_pose import PoseOutput, set_pose, set_transform
from quad_msgs.msg import TrajectoryPoint as TrajectoryPointMsg
from quad_node.codec import packer


def test_a_state_becomes_a_pose_and_a_transform():
    turn = Quat(*Rotation.from_euler("ZYX", [0.3, -0.2, 0.1]).as_quat().tolist())
    pose, found = PoseStamped(), TransformStamped()
    set_pose(pose, VehicleState(p_w=Vec3(1.0, 2.0, 3.0), q_wb=turn), 3_000_000_005)
    assert (pose.header.frame_id, pose.header.stamp) == ("map", Time(sec=3, nanosec=5))
    place, attitude = pose.pose.position, pose.pose.orientation
    assert (place.x, place.y, place.z) == (1.0, 2.0, 3.0)
    assert (attitude.x, attitude.y, attitude.z, attitude.w) == turn
    set_transform(found, pose, "second/base_link")
    assert (found.header, found.child_frame_id) == (pose.header, "second/base_link")
    moved = found.transform.translation
    assert (moved.x, moved.y, moved.z) == (1.0, 2.0, 3.0)
    assert found.transform.rotation == attitude


@pytest.mark.parametrize("yaw", [0.0, 0.4, -3.0])
def test_a_reference_becomes_a_level_pose_with_its_yaw(yaw):
    found = PoseStamped()
    set_pose(found, TrajectoryPoint(p_w=Vec3(1.0, 2.0, 3.5), yaw=yaw), 0)
    expected = Rotation.from_euler("Z", yaw).as_quat()
    turn = found.pose.orientation
    np.testing.assert_allclose([turn.x, turn.y, turn.z, turn.w], expected, atol=1e-15)
    assert found.pose.position.z == 3.5


def test_a_reference_that_is_no_number_has_no_pose():
    node, bag = MagicMock(), MagicMock()
    node.get_namespace.return_value = "/"
    node.resolve_topic_name.side_effect = lambda topic: f"/{topic.lstrip('/')}"
    poses, pack = PoseOutput(node, bag, live=False), packer(TrajectoryPoint, TrajectoryPointMsg, 0)
    poses.take("reference", pack(TrajectoryPoint(yaw=math.inf), 0, 1, 0), 0)
    assert not bag.write.called
    poses.take("reference", pack(TrajectoryPoint(), 50, 51, 100_000_000), 100_000_000)
    assert bag.write.called


def test_the_tf_of_this_installation_is_that_of_every_other():
    """Jazzy's own hash of the type, as rosbags computes it: RViz and tf2_ros of a sourced ROS match it."""
    expected = flight_samples.typestore().hash_rihs01("tf2_msgs/msg/TFMessage")
    described = Path(get_package_share_directory("tf2_msgs"), "msg", "TFMessage.json").read_text("utf-8")
    hashes = {entry["type_name"]: entry["hash_string"] for entry in json.loads(described)["type_hashes"]}
    assert hashes["tf2_msgs/msg/TFMessage"] == expected
