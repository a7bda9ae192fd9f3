"""PX4's own position and attitude controllers on the flight's `reference`, for a comparison on the same vehicle.

In the bridge's place: python own_controllers.py --ros-args --params-file airframe.yaml -p mode:=attitude
In the joined plant's: python own_controllers.py joined --ros-args --params-file joined.yaml

It is the bridge, or the joined plant, with other setpoints: position, velocity and acceleration of the reference, the
drag that the vehicle is said to have added to the acceleration (a + d/m v), heading and its rate. The flight's
controllers run in shadow.
It needs PX4's own px4_msgs; no test runs it.
"""

import math
import sys

from quad_autopilot import frames
from quad_autopilot.node import AutopilotNode
from quad_core.cascade import SIGNALS
from quad_core.geometry import euler_from_quaternion, wrap_angle
from quad_core.types import TrajectoryPoint, Vec3
from quad_mavlink.hil.joined import JoinedInterface
from quad_mavlink.interface import JOINED
from quad_node.codec import MALFORMED, unpacker
from quad_node.main import run
from quad_node.topics import message_type
from quad_px4 import messages
from quad_px4.interface import PX4
from quad_px4.node import Px4Interface


class OwnSetpoints:
    """Sends TrajectorySetpoint instead of what the mode would send; comes before the bridge among the bases."""

    def __init__(self, node):
        super().__init__(node)
        kind = self.px4.TrajectorySetpoint
        self._trajectory_out = node.ros.create_publisher(kind, messages.topic(self.settings.namespace, "in", kind), 10)
        self._read_reference = unpacker(TrajectoryPoint, message_type(SIGNALS["reference"].kind))
        node.subscribe("reference", self._on_reference, raw=True)

    def _on_reference(self, payload):
        try:
            stamped = self._read_reference(payload)
        except MALFORMED:
            return
        self.node.on_command()
        if stamped.finite and self.node.is_obeyed():
            self._send_point(stamped.value)

    def _send(self, found):
        """Keep back what the mode would send."""

    def _send_point(self, point):
        share = self.node.vehicle.drag_coefficient / self.node.vehicle.mass
        a = Vec3(*(a + share * v for a, v in zip(point.a_w, point.v_w, strict=True)))
        message = self.px4.TrajectorySetpoint(timestamp=self.node.stamps().now)
        message.position, message.velocity, message.acceleration = (
            [float(part) for part in frames.world(v)] for v in (point.p_w, point.v_w, a)
        )
        message.jerk = [math.nan] * 3
        message.yaw, message.yawspeed = wrap_angle(0.5 * math.pi - point.yaw), -point.yaw_rate
        self._trajectory_out.publish(message)

    def send_heartbeat(self):
        """Have PX4 fly by position."""
        self._heartbeat_out.publish(self.px4.OffboardControlMode(timestamp=self.node.stamps().now, position=True))

    def send_safe(self, output, newtons, state):
        """Stay here."""
        self._send_point(TrajectoryPoint(p_w=state.p_w, yaw=euler_from_quaternion(state.q_wb).z))


class OwnControllers(OwnSetpoints, Px4Interface):
    """PX4's controllers on a vehicle of PX4's."""


class JoinedOwnControllers(OwnSetpoints, JoinedInterface):
    """PX4's controllers on our plant."""


if __name__ == "__main__":
    is_joined = sys.argv[1:2] == ["joined"] and bool(sys.argv.pop(1))
    kind, interface = (JOINED, JoinedOwnControllers) if is_joined else (PX4, OwnControllers)
    sys.exit(run(kind, lambda: AutopilotNode(kind, interface), __doc__))
