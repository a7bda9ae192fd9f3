"""A node that publishes what RViz and Foxglove draw of a flight, and takes no part in the flight."""

import struct
import sys
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from geometry_msgs.msg import Point, PoseStamped
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.task import Future
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from quad_core.geometry import rotate
from quad_core.types import Quat, Vec3
from quad_flight_log.errors import FlightLogError
from quad_flight_log.recorder.vehicle_pose import body_frame, pose_of, tf_message, transform_of
from quad_flight_log.report.figures import PALETTE, REFERENCE_COLOUR
from quad_node import executor, topics
from quad_node.conversion import set_stamp
from quad_node.parameters import check_words, fail

ARM = 0.9  # m from the centre to a rotor: three times Table 1, to be seen from afar
ROTORS = ((-ARM, 0.0, 0.0), (0.0, -ARM, 0.0), (ARM, 0.0, 0.0), (0.0, ARM, 0.0))  # rear, right, front, left (FLU)
THRUST_SCALE = 0.4  # m of arrow per N
DISTURBANCE_SCALE = 5.0  # m of arrow per N
PATH_POINTS, SPACING = 2000, 0.05  # longest path that is drawn, and m between two points of it
_ARROW_HEAD = 2.2  # width of an arrow's head over that of its shaft
_STAMP = struct.Struct("<iI")
_WATCHED = ("truth", "state", "reference", "actuation", "disturbance")
_HELP = """Publishes what RViz and Foxglove draw of a flight, and takes no part in it: it may start and end at any time.

`markers` (visualization_msgs/MarkerArray): vehicle, reference, flown and planned path, thrust, disturbance.
`pose` (geometry_msgs/PoseStamped): the vehicle in map; the same as a transform on `/tf`.

usage: ros2 run quad_flight_log markers [--ros-args -p period:=0.05 -r __ns:=/NAMESPACE]

parameter: period = 0.05 in [0.005, 10] s: flight time between two sets of markers
example: ROS_DOMAIN_ID=46 ros2 run quad_flight_log markers"""


class Markers(Node):
    """Publishes markers, the pose and, where it can, ``/tf``, once in ``period`` s of flight time.

    It subscribes with best effort, so that it never holds up a publisher. ``truth`` is preferred to ``state``.
    """

    def __init__(self) -> None:
        """Declare the parameter; raises InvalidParameter...Exception where it is refused."""
        super().__init__("markers")
        self.done: Future = Future()
        limits = [FloatingPointRange(from_value=0.005, to_value=10.0)]
        about = "s of flight time between two sets of markers"
        described = ParameterDescriptor(description=about, floating_point_range=limits, read_only=True)
        self._period_ns = round(float(self.declare_parameter("period", 0.05, described).value) * 1e9)
        self._body = body_frame(self.get_namespace())
        self._markers_out = self.create_publisher(MarkerArray, "markers", 10)
        self._pose_out = self.create_publisher(PoseStamped, "pose", 10)
        self._tf_type = tf_message()
        self._tf_out = self.create_publisher(self._tf_type, "/tf", 10) if self._tf_type else None
        self._begin_flight()
        qos = QoSProfile(depth=5, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.BEST_EFFORT)
        for topic in _WATCHED:
            self.create_subscription(topics.TOPICS[topic].type, topic, self._receiver(topic), qos, raw=True)
        self.create_timer(0.1, lambda: None)  # lets a signal end the node where no message comes

    def _begin_flight(self) -> None:
        self._next_ns = 0
        self._newest: dict[str, bytes] = {}  # messages, still packed
        self._flown: deque[Vec3] = deque(maxlen=PATH_POINTS)
        self._planned: deque[Vec3] = deque(maxlen=PATH_POINTS)

    def _receiver(self, topic: str) -> Callable[[bytes], None]:
        def receive(payload: bytes) -> None:
            sec, nanosec = _STAMP.unpack_from(payload, 4)
            stamp_ns = sec * 1_000_000_000 + nanosec
            vehicle = topic == "truth" or (topic == "state" and "truth" not in self._newest)
            if vehicle and stamp_ns < self._next_ns - 2 * self._period_ns:  # the clock went back: another flight
                self._begin_flight()
            self._newest[topic] = payload
            if vehicle and stamp_ns >= self._next_ns:
                self._next_ns = stamp_ns - stamp_ns % self._period_ns + self._period_ns
                self._show(stamp_ns, self._unpacked(topic))

        return receive

    def _unpacked(self, topic: str) -> Any:
        newest = self._newest.get(topic)
        return deserialize_message(newest, topics.TOPICS[topic].type) if newest else None

    def _show(self, stamp_ns: int, body: Any) -> None:
        place, attitude = Vec3(*body.p_w.tolist()), Quat(*body.q_wb.tolist())
        reference, actuation, disturbance = map(self._unpacked, ("reference", "actuation", "disturbance"))
        wanted = Vec3(*reference.p_w.tolist()) if reference else None
        extend(self._flown, place)
        if wanted is not None:
            extend(self._planned, wanted)
        thrust = float(actuation.thrust) if actuation else None
        force = Vec3(*disturbance.force_w.tolist()) if disturbance else None
        found = shapes(place, attitude, wanted, thrust, force)
        for name, path, colour in (("flown", self._flown, PALETTE[0]), ("planned", self._planned, REFERENCE_COLOUR)):
            if len(path) > 1:
                found.append(_marker(name, Marker.LINE_STRIP, path, 0.04, colour))
        for each in found:
            set_stamp(each.header.stamp, stamp_ns)
        self._markers_out.publish(MarkerArray(markers=found))
        pose = pose_of(stamp_ns, place, attitude)
        self._pose_out.publish(pose)
        if self._tf_out and self._tf_type:
            self._tf_out.publish(self._tf_type(transforms=[transform_of(pose, self._body)]))


def extend(path: "deque[Vec3]", point: Vec3) -> None:
    """Append ``point`` to a path if it is far enough from the last one."""
    if not path or sum((new - old) ** 2 for new, old in zip(point, path[-1], strict=True)) >= SPACING**2:
        path.append(point)


def shapes(
    place: Vec3, attitude: Quat, reference: Vec3 | None, thrust: float | None, force: Vec3 | None
) -> list[Marker]:
    """Return the markers of a vehicle in the frame ``map``: place and reference in m, thrust and force (world) in N.

    What is None is not drawn.
    """

    def moved(x: float, y: float, z: float) -> Vec3:
        return _sum(place, rotate(attitude, Vec3(x, y, z)))

    rear, right, front, left = (moved(*rotor) for rotor in ROTORS)
    found = [
        _marker("vehicle", Marker.LINE_LIST, (rear, front, right, left), 0.06 * ARM, REFERENCE_COLOUR),
        _marker("rotors", Marker.SPHERE_LIST, (rear, right, front, left), 0.5 * ARM, PALETTE[0]),
        _marker("forward", Marker.ARROW, (place, moved(1.6 * ARM, 0.0, 0.0)), 0.06 * ARM, PALETTE[3]),
    ]
    if reference is not None:
        found.append(_marker("reference", Marker.SPHERE_LIST, (reference,), 0.25, PALETTE[4]))
    if thrust is not None:
        found.append(_marker("thrust", Marker.ARROW, (place, moved(0.0, 0.0, THRUST_SCALE * thrust)), 0.06, PALETTE[1]))
    if force is not None:
        tip = _sum(place, Vec3(*(DISTURBANCE_SCALE * part for part in force)))
        found.append(_marker("disturbance", Marker.ARROW, (place, tip), 0.06, PALETTE[2]))
    return found


def _sum(one: Vec3, other: Vec3) -> Vec3:
    return Vec3(one.x + other.x, one.y + other.y, one.z + other.z)


def _marker(name: str, kind: int, points: Sequence[Vec3], width: float, colour: str) -> Marker:
    found = Marker(ns=name, type=kind, action=Marker.ADD)
    found.header.frame_id = "map"
    found.pose.orientation.w = 1.0
    found.scale.x = width
    if kind in (Marker.SPHERE_LIST, Marker.ARROW):
        found.scale.y = found.scale.z = width if kind == Marker.SPHERE_LIST else _ARROW_HEAD * width
    red, green, blue = (int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
    found.color = ColorRGBA(r=red, g=green, b=blue, a=1.0)
    found.points = [Point(x=x, y=y, z=z) for x, y, z in points]
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
