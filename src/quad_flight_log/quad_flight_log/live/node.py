"""Nodes that watch a flight and take no part in it; among them markers and transforms for RViz and Foxglove."""

import struct
import sys
from typing import Any, NamedTuple

import rclpy
from geometry_msgs.msg import Point, TransformStamped
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
from quad_flight_log.live.shapes import Shape, Sight, Trail
from quad_flight_log.report.vehicle_drawing import rgb
from quad_msgs.msg import FlightState
from quad_node import executor, shutdown, topics
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
_HELP = """Publishes what RViz and Foxglove draw of a flight, and takes no part in it: it may come and go.

`markers` (visualization_msgs/MarkerArray): vehicle, reference, flown and planned path, thrust, disturbance.
`pose` (geometry_msgs/TransformStamped): map to base_link; the same on `/tf`.

usage: ros2 run quad_flight_log markers [--ros-args -p NAME:=VALUE -r __ns:=/NAMESPACE]

parameters:
  period = 0.05 in [0.005, 10] s: flight time between two sets of markers
  path_points = 2000 in [2, 100000] 1: longest path that is drawn

examples:
  ROS_DOMAIN_ID=46 ros2 run quad_flight_log markers
  ros2 run quad_flight_log markers --ros-args -p period:=0.1 -r __ns:=/second"""


class _Heard(NamedTuple):
    """The newest message of a topic, still packed."""

    stamp_ns: int
    payload: bytes


class Visitor(Node):
    """Hears the newest messages of a flight, unpacks them once in ``period`` s of flight time, and calls ``on_sight``.

    It listens with best effort, so that it never holds up a publisher. ``truth`` is preferred to ``state``.
    """

    def __init__(self, name: str, period: float, namespace: str = "") -> None:
        """Subscribe to what is drawn."""
        super().__init__(name, namespace=namespace or None)
        self.done: Future = Future()
        self.see_every(period)
        self._next_ns = 0
        self._heard: dict[str, _Heard] = {}
        qos = QoSProfile(depth=5, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.BEST_EFFORT)
        for topic in _WATCHED:
            self.create_subscription(topics.TOPICS[topic].type, topic, self._hear(topic), qos, raw=True)
        self.create_subscription(FlightState, "flight/state", self._on_state, topics.latched())
        self.create_timer(0.1, lambda: None)

    def see_every(self, period: float) -> None:
        """Call ``on_sight`` once in ``period`` s of flight time."""
        self._period_ns = round(period * 1e9)

    def on_sight(self, sight: Sight) -> None:
        """React to a new instant."""

    def on_over(self) -> None:
        """React to the end of the flight."""

    def on_again(self) -> None:
        """React to a clock that went back: another flight."""

    def _hear(self, topic: str) -> Any:
        def hear(payload: bytes) -> None:
            sec, nanosec = _STAMP.unpack_from(payload, 4)
            heard = _Heard(sec * 1_000_000_000 + nanosec, payload)
            self._heard[topic] = heard
            if topic == "truth" or (topic == "state" and "truth" not in self._heard):
                self._see(topic, heard)

        return hear

    def _see(self, topic: str, heard: _Heard) -> None:
        if heard.stamp_ns < self._next_ns - 2 * self._period_ns:
            self._heard = {topic: heard}
            self._next_ns = 0
            self.on_again()
        if heard.stamp_ns < self._next_ns:
            return
        self._next_ns = heard.stamp_ns - heard.stamp_ns % self._period_ns + self._period_ns
        body = self._newest(topic)
        reference, actuation, disturbance = map(self._newest, ("reference", "actuation", "disturbance"))
        self.on_sight(
            Sight(
                heard.stamp_ns,
                Vec3(*body.p_w.tolist()),
                Quat(*body.q_wb.tolist()),
                Vec3(*reference.p_w.tolist()) if reference else None,
                float(actuation.thrust) if actuation else None,
                Vec3(*disturbance.force_w.tolist()) if disturbance else None,
            )
        )

    def _newest(self, topic: str) -> Any:
        heard = self._heard.get(topic)
        return deserialize_message(heard.payload, topics.TOPICS[topic].type) if heard else None

    def _on_state(self, message: FlightState) -> None:
        if message.state in (FlightState.ENDED, FlightState.FAILED):
            self.on_over()


class Markers(Visitor):
    """Publishes markers, the pose and, where it can, ``/tf``."""

    def __init__(self) -> None:
        """Declare parameters; raises InvalidParameter...Exception where one is refused."""
        super().__init__("markers", 0.05)
        self.see_every(self._real("period", 0.05, 0.005, 10.0, "s: flight time between two sets"))
        self._length = self._whole("path_points", 2000, 2, 100_000, "longest path that is drawn")
        self._flown, self._planned = Trail(self._length), Trail(self._length)
        prefix = self.get_namespace().strip("/")
        self._body = f"{prefix}/base_link" if prefix else "base_link"
        self._markers_out = self.create_publisher(MarkerArray, "markers", 10)
        self._pose_out = self.create_publisher(TransformStamped, "pose", 10)
        self._tf_type = tf_message()
        self._tf_out = self.create_publisher(self._tf_type, "/tf", 10) if self._tf_type else None

    def _real(self, name: str, default: float, low: float, high: float, meaning: str) -> float:
        limits = FloatingPointRange(from_value=low, to_value=high)
        described = ParameterDescriptor(description=meaning, floating_point_range=[limits], read_only=True)
        return float(self.declare_parameter(name, default, described).value)

    def _whole(self, name: str, default: int, low: int, high: int, meaning: str) -> int:
        limits = IntegerRange(from_value=low, to_value=high)
        described = ParameterDescriptor(description=meaning, integer_range=[limits], read_only=True)
        return int(self.declare_parameter(name, default, described).value)

    def on_again(self) -> None:
        """Forget the paths of the flight before."""
        self._flown, self._planned = Trail(self._length), Trail(self._length)

    def on_sight(self, sight: Sight) -> None:
        """Publish everything for one instant."""
        self._flown.add(sight.position)
        if sight.reference is not None:
            self._planned.add(sight.reference)
        found = [marker(shape, sight.stamp_ns) for shape in shapes.shapes(sight, self._flown, self._planned)]
        self._markers_out.publish(MarkerArray(markers=found))
        transform = transform_of(sight, self._body)
        self._pose_out.publish(transform)
        if self._tf_out and self._tf_type:
            self._tf_out.publish(self._tf_type(transforms=[transform]))


def tf_message() -> type[Any] | None:
    """Return tf2_msgs/TFMessage where it is installed."""
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        return None
    kind: type[Any] = TFMessage
    return kind


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


def transform_of(sight: Sight, body: str) -> TransformStamped:
    """Return the pose of the vehicle as the transform from ``map`` to ``body``."""
    found = TransformStamped(child_frame_id=body)
    found.header.frame_id = "map"
    set_stamp(found.header.stamp, sight.stamp_ns)
    move, turn = found.transform.translation, found.transform.rotation
    move.x, move.y, move.z = sight.position
    turn.x, turn.y, turn.z, turn.w = sight.attitude
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
        shutdown.destroy(node, 0)
        rclpy.try_shutdown()
    return 0
