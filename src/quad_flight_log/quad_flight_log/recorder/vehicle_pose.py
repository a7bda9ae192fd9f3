"""Vehicle and reference as standard tools know them: geometry_msgs/PoseStamped, and the vehicle's transform on ``/tf``.

The recorder writes them into the bag and publishes them, so that RViz and Foxglove show a flight, running or played,
without a message of this workspace.
"""

import time
from collections.abc import Callable

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message, serialize_message
from tf2_msgs.msg import TFMessage

from quad_core.geometry import quaternion_from_euler
from quad_core.types import Quat, Vec3
from quad_flight_log.bag.notes import Qos
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
        self._body = f"{node.get_namespace().strip('/')}/base_link".lstrip("/")
        self._outputs: dict[str, tuple[int, Publisher]] = {}
        for topic, kind in (("pose", PoseStamped), ("/tf", TFMessage), ("reference_pose", PoseStamped)):
            handle = bag.add_topic(node.resolve_topic_name(topic), definition_of(kind), Qos(10))
            self._outputs[topic] = handle, node.create_publisher(kind, topic, 10)

    def following(
        self, keep: Callable[[bytes], None], topic: str, log_ns: Callable[[], int]
    ) -> Callable[[bytes], None]:
        """Return ``keep`` of a topic of FOLLOWED that also gives poses; ``log_ns`` returns the time of the bag."""
        kind = TrajectoryPoint if topic == "reference" else VehicleState
        due_ns, shown = TRUTH_WITHIN_NS if topic == "state" else 0, 0.0

        def on_message(payload: bytes) -> None:
            nonlocal due_ns, shown
            keep(payload)
            self._truth |= topic == "truth"
            now_ns = log_ns()
            if now_ns < due_ns or (self._truth and topic == "state"):
                return
            due_ns = now_ns // PERIOD_NS * PERIOD_NS + PERIOD_NS
            pose = pose_of(deserialize_message(payload, kind))
            if topic == "reference":
                messages = {"reference_pose": pose}
            else:
                messages = {"pose": pose, "/tf": TFMessage(transforms=[transform_of(pose, self._body)])}
            wall, now = time.time_ns(), time.monotonic()
            shows = self._live and now - shown >= LIVE_PERIOD
            shown = now if shows else shown
            for name, message in messages.items():
                (handle, publisher), data = self._outputs[name], serialize_message(message)
                self._bag.write(handle, data, now_ns, wall)
                if shows:
                    publisher.publish(data)

        return on_message
