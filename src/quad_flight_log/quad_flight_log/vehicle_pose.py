"""Vehicle and reference as standard tools know them: geometry_msgs/PoseStamped, and the vehicle's transform on ``/tf``.

The recorder writes them into the bag and publishes them, so that RViz and Foxglove show a flight, running or played,
without a message of this workspace.
"""

import time

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import serialize_message
from tf2_msgs.msg import TFMessage

from quad_core.cascade import SIGNALS
from quad_core.geometry import quaternion_from_euler
from quad_core.types import TrajectoryPoint, Vec3, VehicleState
from quad_flight_log.payload_check import definition_of
from quad_flight_log.writer import BagWriter
from quad_node import topics
from quad_node.codec import set_stamp, unpacker

FOLLOWED = ("truth", "state", "reference")
PERIOD_NS = 20_000_000  # of flight time between two poses in a bag
TRUTH_WITHIN_NS = 100_000_000  # from the beginning, where a vehicle sends it at all
LIVE_PERIOD = 0.04  # s between two published ones: a flight in lockstep may be many times as fast as the clock


def set_pose(pose: PoseStamped, value: VehicleState | TrajectoryPoint, stamp_ns: int) -> None:
    """Write the pose of a state or a reference into ``pose``: in the frame ``map``, attitude from body to world."""
    attitude = value.q_wb if isinstance(value, VehicleState) else quaternion_from_euler(Vec3(0.0, 0.0, value.yaw))
    pose.header.frame_id = "map"
    set_stamp(pose.header.stamp, stamp_ns)
    place, turn = pose.pose.position, pose.pose.orientation
    place.x, place.y, place.z = value.p_w
    turn.x, turn.y, turn.z, turn.w = attitude


def set_transform(transform: TransformStamped, pose: PoseStamped, body: str) -> None:
    """Write a pose into ``transform``: from ``map`` to ``body``."""
    transform.header, transform.child_frame_id = pose.header, body
    place, moved = pose.pose.position, transform.transform.translation
    moved.x, moved.y, moved.z = place.x, place.y, place.z
    transform.transform.rotation = pose.pose.orientation


class PoseOutput:
    """Writes ``pose`` and ``/tf`` of the vehicle and ``reference_pose`` into a bag, one in PERIOD_NS of flight time.

    Where ``live`` it publishes them too, at most one in LIVE_PERIOD. ``state`` counts where no ``truth`` comes.
    """

    def __init__(self, node: Node, bag: BagWriter, live: bool) -> None:
        self._bag, self._live, self._truth = bag, live, False
        self._due_ns = {**dict.fromkeys(FOLLOWED, 0), "state": TRUTH_WITHIN_NS}
        self._shown = dict.fromkeys(FOLLOWED, 0.0)
        self._unpack = {name: unpacker(SIGNALS[name].kind, topics.TOPICS[name].type) for name in FOLLOWED}
        self._body = f"{node.get_namespace().strip('/')}/base_link".lstrip("/")
        # filled again for each pose: making a message takes many times as long as setting its numbers
        self._pose, self._reference, self._tf = PoseStamped(), PoseStamped(), TFMessage(transforms=[TransformStamped()])
        self._outputs: dict[str, tuple[int, Publisher]] = {}
        for topic, kind in (("pose", PoseStamped), ("/tf", TFMessage), ("reference_pose", PoseStamped)):
            handle = bag.add_topic(node.resolve_topic_name(topic), definition_of(kind))
            self._outputs[topic] = handle, node.create_publisher(kind, topic, 10)

    def take(self, topic: str, payload: bytes, now_ns: int) -> None:
        """Take in a message of a topic of FOLLOWED at ``now_ns`` of the bag, and give its pose if one is due."""
        self._truth |= topic == "truth"
        if now_ns < self._due_ns[topic] or (self._truth and topic == "state"):
            return
        self._due_ns[topic] = now_ns // PERIOD_NS * PERIOD_NS + PERIOD_NS
        found = self._unpack[topic](payload)
        if not found.finite:  # no place, and an infinite yaw has no cosine
            return
        if topic == "reference":
            set_pose(self._reference, found.value, found.stamp_ns)
            messages = {"reference_pose": self._reference}
        else:
            set_pose(self._pose, found.value, found.stamp_ns)
            set_transform(self._tf.transforms[0], self._pose, self._body)
            messages = {"pose": self._pose, "/tf": self._tf}
        wall, now = time.time_ns(), time.monotonic()
        shows = self._live and now - self._shown[topic] >= LIVE_PERIOD
        self._shown[topic] = now if shows else self._shown[topic]
        for name, message in messages.items():
            (handle, publisher), data = self._outputs[name], serialize_message(message)
            self._bag.write(handle, data, now_ns, wall)
            if shows:
                publisher.publish(data)
