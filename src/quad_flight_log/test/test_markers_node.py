"""The markers node draws a flight: where against SciPy's rotations, and over ROS; the layouts show what it sends."""

import json
import re
import subprocess
import time
from collections import deque
from itertools import pairwise
from pathlib import Path

import flight_samples
import numpy as np
import pytest
import rclpy
import yaml
from ament_index_python.packages import get_package_prefix, get_package_share_directory
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from scipy.spatial.transform import Rotation
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from quad_bringup.domains import reserved_domain
from quad_core.types import Quat, Vec3
from quad_flight_log.cli import main
from quad_flight_log.live.layouts import layout_files
from quad_flight_log.live.node import ARM, DISTURBANCE_SCALE, THRUST_SCALE, Markers, extend, shapes
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
        self.arrays, self.poses, self.transforms = [], [], []
        self.create_subscription(TFMessage, "/tf", self.transforms.append, 10)
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
    assert flight.transforms[-1].transforms[0].child_frame_id == "base_link"
    flight.arrays.clear()
    fly(ros, flight, lambda: bool(flight.arrays), start_ms=0)
    assert "flown" not in {marker.ns for marker in flight.arrays[0].markers}, "a new flight starts a new path"


def executable():
    return str(Path(get_package_prefix("quad_flight_log"), "lib", "quad_flight_log", "markers"))


def test_the_executable_explains_and_refuses():
    done = subprocess.run([executable(), "--help"], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0
    assert "period = 0.05" in done.stdout
    arguments = [executable(), "--ros-args", "-p", "period:=0.0"]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2, done.stderr
    assert "period" in done.stderr


def test_the_tf_of_this_installation_is_that_of_every_other():
    """Jazzy's own hash of the type, as rosbags computes it: RViz and tf2_ros of a sourced ROS match it."""
    kind = tf_message()
    assert kind is not None, "tf2_msgs is built beside the wheels by scripts/setup, and comes with a sourced ROS"
    expected = flight_samples.typestore().hash_rihs01("tf2_msgs/msg/TFMessage")
    described = Path(get_package_share_directory("tf2_msgs"), "msg", "TFMessage.json").read_text("utf-8")
    hashes = {entry["type_name"]: entry["hash_string"] for entry in json.loads(described)["type_hashes"]}
    assert hashes["tf2_msgs/msg/TFMessage"] == expected


PLACE = np.array([1.0, -2.0, 3.0])


def drawn(attitude, reference=None, thrust=None, force=None):
    found = shapes(Vec3(*PLACE), attitude, reference, thrust, force)
    return {each.ns: np.array([(point.x, point.y, point.z) for point in each.points]) for each in found}


@pytest.mark.parametrize("seed", range(4))
def test_body_and_thrust_turn_with_the_attitude_and_the_disturbance_does_not(seed):
    turn = Rotation.random(rng=np.random.default_rng(seed))
    force = np.array([0.5, 0.0, -0.25])
    found = drawn(Quat(*turn.as_quat()), thrust=5.0, force=Vec3(*force))
    np.testing.assert_allclose(found["rotors"][2], PLACE + turn.apply([ARM, 0.0, 0.0]), atol=1e-12)
    np.testing.assert_allclose(found["rotors"][3], PLACE + turn.apply([0.0, ARM, 0.0]), atol=1e-12)
    np.testing.assert_array_equal(found["thrust"][0], PLACE)
    np.testing.assert_allclose(found["thrust"][1], PLACE + turn.apply([0.0, 0.0, 5.0 * THRUST_SCALE]), atol=1e-12)
    np.testing.assert_allclose(found["disturbance"][1], PLACE + DISTURBANCE_SCALE * force, atol=1e-12)


def test_only_what_is_known_is_drawn():
    assert set(drawn(Quat())) == {"vehicle", "rotors", "forward"}
    assert drawn(Quat(), Vec3(1.0, 2.0, 3.0))["reference"].tolist() == [[1.0, 2.0, 3.0]]


def test_a_path_forgets_its_oldest_points_and_skips_near_ones():
    path = deque(maxlen=3)
    for x in (0.0, 0.04, 0.2, 0.24, 0.4, 0.6):
        extend(path, Vec3(x, 0.0, 0.0))
    assert [point.x for point in path] == [0.2, 0.4, 0.6]


def test_every_plotted_path_of_the_layout_is_a_number_of_its_message():
    panels = json.loads(layout_files("uav1")["flight.json"])["configById"]
    plotted = [path["value"] for panel in panels.values() for path in panel.get("paths", [])]
    assert len(plotted) >= 14
    for text in plotted:
        topic, path = re.fullmatch(r"/uav1/([\w/]+)\.(.+)", text).groups()
        value = topics.TOPICS[topic].type()
        for name, index in re.findall(r"(\w+)(?:\[(\d)\])?", path):
            value = getattr(value, name)
            value = value[int(index)] if index else value
        assert float(value) == 0.0


def test_both_layouts_show_what_the_markers_node_publishes_in_its_namespace(tmp_path, capsys):
    assert main(["view", "--namespace", "/second/", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / "flight.json"), str(tmp_path / "flight.rviz")]
    layout = json.loads((tmp_path / "flight.json").read_text())
    displays = yaml.safe_load((tmp_path / "flight.rviz").read_text())["Visualization Manager"]["Displays"]
    expected = {"/second/markers", "/second/pose", "/second/odom"}
    assert set(layout["configById"]["3D!space"]["topics"]) == expected
    assert {display["Topic"]["Value"] for display in displays if "Topic" in display} == expected
    placed = re.findall(r'"((?:Plot|3D)![^"]+)"', json.dumps(layout["layout"]))
    assert sorted(placed) == sorted(layout["configById"])
