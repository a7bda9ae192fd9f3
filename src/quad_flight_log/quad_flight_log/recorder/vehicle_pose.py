"""The pose of the vehicle as standard tools know it: geometry_msgs/PoseStamped, and a transform on ``/tf``.

The recorder writes both into the bag, so that RViz and Foxglove show the vehicle without a message of this workspace.
"""

import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped, TransformStamped
from rclpy.serialization import deserialize_message, serialize_message

from quad_core.types import Quat, Vec3
from quad_flight_log.bag.notes import Qos
from quad_flight_log.bag.writer import BagWriter
from quad_flight_log.recorder.message_fields import definition_of
from quad_msgs.msg import VehicleState
from quad_node.conversion import set_stamp

PERIOD_NS = 20_000_000  # of flight time between two poses in a bag


def tf_message() -> Any:
    """Return the class tf2_msgs/TFMessage where it is installed, else None."""
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        return None
    return TFMessage


def body_frame(namespace: str) -> str:
    """Return the name of the vehicle's frame in a namespace."""
    return f"{namespace.strip('/')}/base_link".lstrip("/")


def pose_of(stamp_ns: int, position: Vec3, attitude: Quat) -> PoseStamped:
    """Return the pose of the vehicle in the frame ``map``: place in m, attitude from body to world, xyzw."""
    found = PoseStamped()
    found.header.frame_id = "map"
    set_stamp(found.header.stamp, stamp_ns)
    place, turn = found.pose.position, found.pose.orientation
    place.x, place.y, place.z = position
    turn.x, turn.y, turn.z, turn.w = attitude
    return found


def transform_of(pose: PoseStamped, body: str) -> TransformStamped:
    """Return a pose as the transform from ``map`` to ``body``."""
    found = TransformStamped(header=pose.header, child_frame_id=body)
    place, turn = pose.pose.position, pose.pose.orientation
    found.transform.translation.x, found.transform.translation.y, found.transform.translation.z = (
        place.x,
        place.y,
        place.z,
    )
    found.transform.rotation = turn
    return found


class PoseWriter:
    """Writes ``pose`` and ``/tf`` into a bag from the states that are recorded, one in PERIOD_NS of flight time."""

    def __init__(self, bag: BagWriter, pose_topic: str, namespace: str) -> None:
        """Declare the topics; ``pose_topic`` in full."""
        self._bag, self._body, self._next_ns = bag, body_frame(namespace), 0
        self._pose = bag.add_topic(pose_topic, definition_of(PoseStamped), Qos(10))
        self._tf_type = tf_message()
        self._tf = bag.add_topic("/tf", definition_of(self._tf_type), Qos(100)) if self._tf_type else -1

    def following(self, keep: Callable[[bytes], None], log_ns: Callable[[], int]) -> Callable[[bytes], None]:
        """Return ``keep`` of a topic of states, that also writes the pose; ``log_ns`` gives the time of the bag."""

        def on_message(payload: bytes) -> None:
            keep(payload)
            if log_ns() >= self._next_ns:
                self._next_ns = log_ns() // PERIOD_NS * PERIOD_NS + PERIOD_NS
                self._write(deserialize_message(payload, VehicleState), log_ns())

        return on_message

    def _write(self, state: VehicleState, log_ns: int) -> None:
        stamp_ns = state.stamp.sec * 1_000_000_000 + state.stamp.nanosec
        pose = pose_of(stamp_ns, Vec3(*state.p_w.tolist()), Quat(*state.q_wb.tolist()))
        wall = time.time_ns()
        self._bag.write(self._pose, serialize_message(pose), log_ns, wall)
        if self._tf_type:
            transforms = self._tf_type(transforms=[transform_of(pose, self._body)])
            self._bag.write(self._tf, serialize_message(transforms), log_ns, wall)
