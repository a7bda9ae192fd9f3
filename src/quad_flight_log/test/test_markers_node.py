"""The markers node hears a flight and publishes what it saw, with tf2_msgs (a stand-in) and without."""

import json
import subprocess
import sys
import time
import types
from itertools import pairwise
from pathlib import Path

import flight_samples
import pytest
import rclpy
from ament_index_python.packages import get_package_prefix, get_package_share_directory
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path as StandInTransforms
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from visualization_msgs.msg import Marker, MarkerArray

from quad_bringup.domains import reserved_domain
from quad_flight_log.live.node import Markers
from quad_flight_log.recorder.vehicle_pose import tf_message
from quad_msgs.msg import Actuation, Disturbance, TrajectoryPoint, VehicleState
from quad_node import topics


class Flight(Node):
    """Publishes one instant of a flight again and again, and keeps what comes back."""

    def __init__(self):
        super().__init__("flight_of_the_test")
        kinds = {
            "truth": VehicleState,
            "reference": TrajectoryPoint,
            "actuation": Actuation,
            "disturbance": Disturbance,
        }
        self.out = {name: self.create_publisher(kind, name, topics.stream()) for name, kind in kinds.items()}
        self.arrays, self.poses = [], []
        self.create_subscription(MarkerArray, "markers", self.arrays.append, 10)
        self.create_subscription(PoseStamped, "pose", self.poses.append, 10)

    def say(self, stamp_ms):
        stamp = Time(sec=stamp_ms // 1000, nanosec=stamp_ms % 1000 * 1_000_000)
        self.out["reference"].publish(TrajectoryPoint(stamp=stamp, p_w=[1.0, 2.0, 3.5]))
        self.out["actuation"].publish(Actuation(stamp=stamp, thrust=5.0))
        self.out["disturbance"].publish(Disturbance(stamp=stamp, force_w=[0.5, 0.0, 0.0]))
        position = [stamp_ms * 1e-3, 2.0, 3.0]
        self.out["truth"].publish(VehicleState(stamp=stamp, p_w=position, q_wb=[0.0, 0.0, 0.6, 0.8]))


@pytest.fixture
def ros():
    with reserved_domain(None) as domain:
        rclpy.init(args=[], domain_id=domain)
        executor = SingleThreadedExecutor()
        yield executor
        executor.shutdown()
        rclpy.try_shutdown()


def fly(executor, flight, until, start_ms=1000, seconds=20.0):
    end, stamp = time.monotonic() + seconds, start_ms
    while not until() and time.monotonic() < end:
        flight.say(stamp)
        stamp += 10
        for _ in range(12):
            executor.spin_once(timeout_sec=0.002)
    assert until(), f"{len(flight.arrays)} marker arrays"


def test_markers_and_pose_of_an_instant(ros):
    flight, markers = Flight(), Markers()
    ros.add_node(flight)
    ros.add_node(markers)
    fly(ros, flight, lambda: len(flight.arrays) > 3 and len(flight.arrays[-1].markers) == 7 and len(flight.poses) > 3)
    found = {marker.ns: marker for marker in flight.arrays[-1].markers}
    assert set(found) == {"vehicle", "rotors", "forward", "flown", "reference", "thrust", "disturbance"}
    assert {marker.header.frame_id for marker in found.values()} == {"map"}
    assert found["thrust"].type == Marker.ARROW
    tip = found["thrust"].points[1]
    assert (tip.y, tip.z) == (2.0, pytest.approx(3.0 + 0.4 * 5.0))
    assert found["reference"].points[0].z == 3.5
    stamps = [pose.header.stamp.sec * 1000 + pose.header.stamp.nanosec // 1_000_000 for pose in flight.poses]
    assert min(later - earlier for earlier, later in pairwise(stamps)) >= 50
    pose = flight.poses[-1]
    assert pose.header.frame_id == "map"
    assert pose.pose.position.x == pytest.approx(stamps[-1] * 1e-3)
    assert (pose.pose.orientation.z, pose.pose.orientation.w) == (0.6, 0.8)
    flight.arrays.clear()
    fly(ros, flight, lambda: bool(flight.arrays), start_ms=0)
    assert "flown" not in {marker.ns for marker in flight.arrays[0].markers}, "a new flight starts a new path"


def test_tf_is_published_where_its_message_is_installed(ros, monkeypatch):
    class Transforms:
        def __new__(cls, transforms):
            sent.extend(transforms)
            return StandInTransforms()

    sent = []
    package, module = types.ModuleType("tf2_msgs"), types.ModuleType("tf2_msgs.msg")
    module.TFMessage = Transforms
    monkeypatch.setitem(sys.modules, "tf2_msgs", package)
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", module)
    assert tf_message() is Transforms
    made = {}
    create = Node.create_publisher
    monkeypatch.setattr(
        Node,
        "create_publisher",
        lambda self, kind, name, *rest, **more: made.setdefault(
            name, create(self, StandInTransforms if kind is Transforms else kind, name, *rest, **more)
        ),
    )
    flight, markers = Flight(), Markers()
    assert "/tf" in made
    ros.add_node(flight)
    ros.add_node(markers)
    fly(ros, flight, lambda: bool(sent))
    assert sent[0].child_frame_id == "base_link"


def test_without_tf2_msgs_there_is_no_tf(monkeypatch):
    monkeypatch.setitem(sys.modules, "tf2_msgs", None)
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", None)
    assert tf_message() is None


def executable():
    return str(Path(get_package_prefix("quad_flight_log"), "lib", "quad_flight_log", "markers"))


def test_the_executable_explains_and_refuses():
    done = subprocess.run([executable(), "--help"], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0
    assert "path_points = 2000" in done.stdout
    for value, word in (("period:=0.0", "period"), ("path_points:=many", "path_points")):
        arguments = [executable(), "--ros-args", "-p", value]
        done = subprocess.run(arguments, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 2, done.stderr
        assert word in done.stderr


def test_the_tf_of_this_installation_is_that_of_every_other():
    """Jazzy's own hash of the type, as rosbags computes it: RViz and tf2_ros of a sourced ROS match it."""
    kind = tf_message()
    assert kind is not None, "tf2_msgs is built beside the wheels by scripts/setup, and comes with a sourced ROS"
    expected = flight_samples.typestore().hash_rihs01("tf2_msgs/msg/TFMessage")
    described = Path(get_package_share_directory("tf2_msgs"), "msg", "TFMessage.json").read_text("utf-8")
    hashes = {entry["type_name"]: entry["hash_string"] for entry in json.loads(described)["type_hashes"]}
    assert hashes["tf2_msgs/msg/TFMessage"] == expected
