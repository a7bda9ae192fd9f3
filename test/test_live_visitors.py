"""A flight that is watched: it publishes vehicle and reference for RViz and Foxglove, and its bag holds them."""

import numpy as np
import pytest
from flying import finish, start, stranger, wait_until
from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from tf2_msgs.msg import TFMessage

from quad_bringup.domains import reserved_domain
from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight


def test_standard_tools_see_vehicle_and_reference_and_the_bag_holds_them(tmp_path):
    with reserved_domain(None) as domain:
        pass
    kinds = {"pose": PoseStamped, "reference_pose": PoseStamped, "/tf": TFMessage}
    seen = {topic: [] for topic in kinds}
    with stranger(domain, "onlooker") as node:
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        for topic, kind in kinds.items():
            node.create_subscription(kind, topic, seen[topic].append, 10)
        flight = start("hover", "--duration", "2", "--realtime", "--domain", str(domain), "--out", tmp_path / "bag")

        def shown() -> bool:
            executor.spin_once(timeout_sec=0.1)
            return all(len(found) > 20 for found in seen.values())

        wait_until(shown, 90.0, "poses")
    done = finish(flight)
    assert done.returncode == 0, done.stdout + done.stderr
    bag = open_flight(tmp_path / "bag")
    truth, poses, transforms = bag.array("truth"), bag.array("pose"), bag.array("/tf")
    assert abs(len(poses) - len(truth) / 10) < 5
    assert len(transforms) == len(poses)
    rows = np.searchsorted(truth["stamp_ns"], poses["stamp_ns"])
    np.testing.assert_array_equal(truth["stamp_ns"][rows], poses["stamp_ns"])
    for axis, letter in enumerate("xyz"):
        np.testing.assert_array_equal(truth["p_w"][rows, axis], poses["pose"]["position"][letter])
    last = transforms["transforms"][-1][0]
    assert (last["header"]["frame_id"], last["child_frame_id"]) == ("map", "base_link")
    assert last["transform"]["translation"]["z"] == truth["p_w"][rows[-1], 2]
    assert {pose.header.frame_id for pose in seen["pose"]} == {"map"}
    reference = bag.array("reference_pose")["pose"]["position"]["z"]
    assert reference[-1] == bag.array("reference")["p_w"][-1, 2]
    assert seen["reference_pose"][-1].pose.position.z in reference
