"""What the simulator publishes for tools only: decimated odometry and /clock. No control decision depends on it."""

from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock

from quad_core.rotations import rotate_inverse
from quad_core.types import VehicleState
from quad_node.conversion import set_stamp
from quad_node.flight_node import FlightNode


class ToolsOutput:
    """Publishes odom (pose in map, twist in base_link) and /clock at their own pace."""

    def __init__(self, node: FlightNode) -> None:
        """Make the publishers on ``node``."""
        self._settings = node.resolved.node
        self._odom_out = node.publisher("odom", match=not self._settings.publish_state)
        self._clock_out = node.publisher("/clock", match=False)
        self._odom = Odometry(child_frame_id="base_link")
        self._odom.header.frame_id = "map"
        self._clock = Clock()

    def publish(self, step: int, stamp_ns: int, state: VehicleState) -> None:
        """Publish what is due at ``step``."""
        if step % self._settings.clock_period_steps == 0:
            set_stamp(self._clock.clock, stamp_ns)
            self._clock_out.publish(self._clock)
        if step % self._settings.odom_period_steps == 0:
            set_stamp(self._odom.header.stamp, stamp_ns)
            pose, twist = self._odom.pose.pose, self._odom.twist.twist
            pose.position.x, pose.position.y, pose.position.z = state.p_w
            q = pose.orientation
            q.x, q.y, q.z, q.w = state.q_wb
            twist.linear.x, twist.linear.y, twist.linear.z = rotate_inverse(state.q_wb, state.v_w)
            twist.angular.x, twist.angular.y, twist.angular.z = state.omega_b
            self._odom_out.publish(self._odom)
