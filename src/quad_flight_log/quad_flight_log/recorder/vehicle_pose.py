"""Vehicle and reference as standard tools know them: geometry_msgs/PoseStamped, and the vehicle's transform on ``/tf``.

The recorder writes them into the bag and publishes them, so that RViz and Foxglove show a flight, running or played,
without a message of this workspace.
"""

import time

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message, serialize_message
from tf2_msgs.msg import TFMessage

from quad_core.geometry import quaternion_from_euler
from quad_core.types import Quat, Vec3
from quad_flight_log.bag.writer import BagWriter
from quad_flight_log.recorder.message_fields import definition_of
from quad_msgs.msg import TrajectoryPoint, VehicleState

FOLLOWED = ("truth", "state", "reference")
PERIOD_NS = 20_000_000  # of flight time between two poses in a bag
TRUTH_WITHIN_NS = 100_000_000  # from the beginning, where a vehicle sends it at all
LIVE_PERIOD = 0.04  # s between two published ones: a flight in lockstep may be many times as fast as the clock


def pose_of(message: VehicleState | TrajectoryPoint) -> PoseStamped:
    """Return the pose of a state or a reference in the frame ``map``, attitude from body to world."""
    state = isinstance(message, VehicleState)
    attitude = Quat(*message.q_wb.tolist()) if state else quaternion_from_euler(Vec3(0.0, 0.0, message.yaw))
    found = PoseStamped()
    found.header.frame_id, found.header.stamp = "map", message.stamp
    place, turn = found.pose.position, found.pose.orientation
    place.x, place.y, place.z = message.p_w.tolist()
    turn.x, turn.y, turn.z, turn.w = attitude
    return found


def transform_of(pose: PoseStamped, body: str) -> TransformStamped:
    """Return a pose as the transform from ``map`` to ``body``."""
    found = TransformStamped(header=pose.header, child_frame_id=body)
    place, moved = pose.pose.position, found.transform.translation
    moved.x, moved.y, moved.z = place.x, place.y, place.z
    found.transform.rotation = pose.pose.orientation
    return found


class PoseOutput:
    """Writes ``pose`` and ``/tf`` of the vehicle and ``reference_pose`` into a bag, one in PERIOD_NS of flight time.

    Where ``live`` it publishes them too, at most one in LIVE_PERIOD. ``state`` counts where no ``truth`` comes.
    """

    def __init__(self, node: Node, bag: BagWriter, live: bool) -> None:
        """Declare the topics."""
        self._bag, self._live, self._truth = bag, live, False
        self._due_ns = {**dict.fromkeys(FOLLOWED, 0), "state": TRUTH_WITHIN_NS}
        self._shown = dict.fromkeys(FOLLOWED, 0.0)
        self._body = f"{node.get_namespace().strip('/')}/base_link".lstrip("/")
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
        if topic == "reference":
            messages = {"reference_pose": pose_of(deserialize_message(payload, TrajectoryPoint))}
        else:
            pose = pose_of(deserialize_message(payload, VehicleState))
            messages = {"pose": pose, "/tf": TFMessage(transforms=[transform_of(pose, self._body)])}
        wall, now = time.time_ns(), time.monotonic()
        shows = self._live and now - self._shown[topic] >= LIVE_PERIOD
        self._shown[topic] = now if shows else self._shown[topic]
        for name, message in messages.items():
            (handle, publisher), data = self._outputs[name], serialize_message(message)
            self._bag.write(handle, data, now_ns, wall)
            if shows:
                publisher.publish(data)
