"""A node that publishes what RViz and Foxglove draw of a flight, and takes no part in the flight."""

import struct
import sys
from collections.abc import Callable
from typing import Any, NamedTuple

import rclpy
from geometry_msgs.msg import Point, PoseStamped
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.task import Future
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from quad_core.types import Quat, Vec3
from quad_flight_log.errors import FlightLogError
from quad_flight_log.live import shapes
from quad_flight_log.live.shapes import Shape, Snapshot, Trail
from quad_flight_log.recorder.vehicle_pose import body_frame, pose_of, tf_message, transform_of
from quad_flight_log.report.vehicle_drawing import rgb
from quad_node import executor, topics
from quad_node.conversion import set_stamp
from quad_node.parameters import check_words, fail

_STAMP = struct.Struct("<iI")
_WATCHED = ("truth", "state", "reference", "actuation", "disturbance")
_MARKER_KINDS = {
    shapes.LINES: Marker.LINE_LIST,
    shapes.STRIP: Marker.LINE_STRIP,
    shapes.DOTS: Marker.SPHERE_LIST,
    shapes.ARROW: Marker.ARROW,
}
_HEAD = 2.2  # width of an arrow's head over that of its shaft
_HELP = """Publishes what RViz and Foxglove draw of a flight, and takes no part in it: it may start and end at any time.

`markers` (visualization_msgs/MarkerArray): vehicle, reference, flown and planned path, thrust, disturbance.
`pose` (geometry_msgs/PoseStamped): the vehicle in map; the same as a transform on `/tf`.

usage: ros2 run quad_flight_log markers [--ros-args -p NAME:=VALUE -r __ns:=/NAMESPACE]

parameters:
  period = 0.05 in [0.005, 10] s: flight time between two sets of markers
  path_points = 2000 in [2, 100000] 1: longest path that is drawn

examples:
  ROS_DOMAIN_ID=46 ros2 run quad_flight_log markers
  ros2 run quad_flight_log markers --ros-args -p period:=0.1 -r __ns:=/second"""


class _Message(NamedTuple):
    """The newest message of a topic, still packed."""

    stamp_ns: int
    payload: bytes


class Markers(Node):
    """Publishes markers, the pose and, where it can, ``/tf``, once in ``period`` s of flight time.

    It subscribes with best effort, so that it never holds up a publisher. ``truth`` is preferred to ``state``.
    """

    def __init__(self) -> None:
        """Declare parameters; raises InvalidParameter...Exception where one is refused."""
        super().__init__("markers")
        self.done: Future = Future()
        self._period_ns = round(self._real("period", 0.05, 0.005, 10.0, "s: flight time between two sets") * 1e9)
        self._length = self._whole("path_points", 2000, 2, 100_000, "longest path that is drawn")
        self._flown, self._planned = Trail(self._length), Trail(self._length)
        self._next_ns = 0
        self._newest: dict[str, _Message] = {}
        self._body = body_frame(self.get_namespace())
        self._markers_out = self.create_publisher(MarkerArray, "markers", 10)
        self._pose_out = self.create_publisher(PoseStamped, "pose", 10)
        self._tf_type = tf_message()
        self._tf_out = self.create_publisher(self._tf_type, "/tf", 10) if self._tf_type else None
        qos = QoSProfile(depth=5, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.BEST_EFFORT)
        for topic in _WATCHED:
            self.create_subscription(topics.TOPICS[topic].type, topic, self._receiver(topic), qos, raw=True)
        self.create_timer(0.1, lambda: None)

    def _real(self, name: str, default: float, low: float, high: float, meaning: str) -> float:
        limits = FloatingPointRange(from_value=low, to_value=high)
        described = ParameterDescriptor(description=meaning, floating_point_range=[limits], read_only=True)
        return float(self.declare_parameter(name, default, described).value)

    def _whole(self, name: str, default: int, low: int, high: int, meaning: str) -> int:
        limits = IntegerRange(from_value=low, to_value=high)
        described = ParameterDescriptor(description=meaning, integer_range=[limits], read_only=True)
        return int(self.declare_parameter(name, default, described).value)

    def _receiver(self, topic: str) -> Callable[[bytes], None]:
        def receive(payload: bytes) -> None:
            sec, nanosec = _STAMP.unpack_from(payload, 4)
            self._newest[topic] = _Message(sec * 1_000_000_000 + nanosec, payload)
            if topic == "truth" or (topic == "state" and "truth" not in self._newest):
                self._show(topic, self._newest[topic])

        return receive

    def _show(self, topic: str, newest: _Message) -> None:
        if newest.stamp_ns < self._next_ns - 2 * self._period_ns:  # the clock went back: another flight
            self._newest = {topic: newest}
            self._next_ns = 0
            self._flown, self._planned = Trail(self._length), Trail(self._length)
        if newest.stamp_ns < self._next_ns:
            return
        self._next_ns = newest.stamp_ns - newest.stamp_ns % self._period_ns + self._period_ns
        body = self._unpacked(topic)
        reference, actuation, disturbance = map(self._unpacked, ("reference", "actuation", "disturbance"))
        self._publish(
            Snapshot(
                newest.stamp_ns,
                Vec3(*body.p_w.tolist()),
                Quat(*body.q_wb.tolist()),
                Vec3(*reference.p_w.tolist()) if reference else None,
                float(actuation.thrust) if actuation else None,
                Vec3(*disturbance.force_w.tolist()) if disturbance else None,
            )
        )

    def _unpacked(self, topic: str) -> Any:
        newest = self._newest.get(topic)
        return deserialize_message(newest.payload, topics.TOPICS[topic].type) if newest else None

    def _publish(self, snapshot: Snapshot) -> None:
        self._flown.add(snapshot.position)
        if snapshot.reference is not None:
            self._planned.add(snapshot.reference)
        found = [marker(shape, snapshot.stamp_ns) for shape in shapes.shapes(snapshot, self._flown, self._planned)]
        self._markers_out.publish(MarkerArray(markers=found))
        pose = pose_of(snapshot.stamp_ns, snapshot.position, snapshot.attitude)
        self._pose_out.publish(pose)
        if self._tf_out and self._tf_type:
            self._tf_out.publish(self._tf_type(transforms=[transform_of(pose, self._body)]))


def marker(shape: Shape, stamp_ns: int) -> Marker:
    """Return the marker of a shape in the frame ``map``."""
    found = Marker(ns=shape.name, type=_MARKER_KINDS[shape.kind], action=Marker.ADD)
    found.header.frame_id = "map"
    set_stamp(found.header.stamp, stamp_ns)
    found.pose.orientation.w = 1.0
    found.scale.x = shape.width
    if shape.kind in (shapes.DOTS, shapes.ARROW):
        found.scale.y = shape.width if shape.kind == shapes.DOTS else _HEAD * shape.width
        found.scale.z = shape.width if shape.kind == shapes.DOTS else _HEAD * shape.width
    red, green, blue = rgb(shape.colour)
    found.color = ColorRGBA(r=red / 255.0, g=green / 255.0, b=blue / 255.0, a=1.0)
    found.points = [Point(x=x, y=y, z=z) for x, y, z in shape.points]
    return found


def markers_main() -> None:
    """Run the markers node."""
    if "--help" in sys.argv or "-h" in sys.argv:
        sys.stdout.write(f"{_HELP}\n")
        sys.exit(0)
    sys.exit(_run_markers())


def _run_markers() -> int:
    try:
        check_words(sys.argv)
        executor.init(sys.argv)
    except Exception as error:  # rclpy raises its own RCLError and UnknownROSArgsError here: bad arguments
        return fail("markers", " ".join(str(error).split()))
    try:
        node = Markers()
    except (InvalidParameterTypeException, InvalidParameterValueException, FlightLogError) as error:
        rclpy.try_shutdown()
        return fail("markers", str(error))
    stop: list[str] = []
    executor.on_signals(stop, node.done)
    try:
        executor.spin([node], node.done)
    finally:
        executor.destroy(node, 0)
        rclpy.try_shutdown()
    return 0
