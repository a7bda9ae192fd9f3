"""What the simulator publishes for tools only: decimated odometry and the clock. No control decision depends on it."""

from quad_core.geometry import rotate_inverse
from quad_core.types import VehicleState
from quad_node.codec import pack_clock, pack_odometry
from quad_node.flight_node import FlightNode


class ToolsOutput:
    """Publishes odom (pose in map, twist in base_link) and clock at their own pace."""

    def __init__(self, node: FlightNode) -> None:
        """Make the publishers on ``node``."""
        self._settings = node.resolved.node
        self._odom_out = node.publisher("odom", match=not self._settings.publish_state)
        self._clock_out = node.publisher("clock", match=False)

    def publish(self, step: int, stamp_ns: int, state: VehicleState) -> None:
        """Publish what is due at ``step``."""
        if step % self._settings.clock_period_steps == 0:
            self._clock_out.publish(pack_clock(stamp_ns))
        if step % self._settings.odom_period_steps == 0:
            self._odom_out.publish(pack_odometry(state, rotate_inverse(state.q_wb, state.v_w), stamp_ns))
