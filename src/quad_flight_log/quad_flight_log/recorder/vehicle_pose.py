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

PERIOD_NS = 20_000_000  # of flight time between two poses in a bag
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
    """Writes ``pose`` and ``/tf`` of a state, ``reference_pose`` of a reference into a bag, one in PERIOD_NS.

    Where ``live`` it publishes them too, at most one in LIVE_PERIOD.
    """

    def __init__(self, node: Node, bag: BagWriter, live: bool) -> None:
        """Declare nothing yet."""
        self._node, self._bag, self._live = node, bag, live

    def following(
        self, keep: Callable[[bytes], None], topic: str, log_ns: Callable[[], int]
    ) -> Callable[[bytes], None]:
        """Return ``keep`` of a topic that also gives poses; ``log_ns`` returns the time of the bag."""
        wanted = topic == "reference"
        kind = TrajectoryPoint if wanted else VehicleState
        outputs = [self._output("reference_pose" if wanted else "pose", PoseStamped, 10)]
        if not wanted:
            outputs.append(self._output("/tf", TFMessage, 100))
        body = f"{self._node.get_namespace().strip('/')}/base_link".lstrip("/")
        due_ns, shown = 0, 0.0

        def on_message(payload: bytes) -> None:
            nonlocal due_ns, shown
            keep(payload)
            now_ns = log_ns()
            if now_ns < due_ns:
                return
            due_ns = now_ns // PERIOD_NS * PERIOD_NS + PERIOD_NS
            pose = pose_of(deserialize_message(payload, kind))
            messages = [pose] if wanted else [pose, TFMessage(transforms=[transform_of(pose, body)])]
            wall, now = time.time_ns(), time.monotonic()
            shows = self._live and now - shown >= LIVE_PERIOD
            shown = now if shows else shown
            for (handle, publisher), message in zip(outputs, messages, strict=True):
                data = serialize_message(message)
                self._bag.write(handle, data, now_ns, wall)
                if shows:
                    publisher.publish(data)

        return on_message

    def _output(self, topic: str, kind: type, depth: int) -> tuple[int, Publisher]:
        name = self._node.resolve_topic_name(topic)
        handle = self._bag.add_topic(name, definition_of(kind), Qos(depth))
        return handle, self._node.create_publisher(kind, topic, depth)
