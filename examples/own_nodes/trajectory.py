"""A trajectory node of your own, on rclpy and quad_msgs: climbs by half a metre, in both clocks.

Fly it: scripts/fly hover --own trajectory="python3 examples/own_nodes/trajectory.py"
"""

import math
import zlib

import rclpy
import rclpy.executors
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future

from quad_msgs.msg import FlightPlan, FlightState, NodeStatus, TrajectoryPoint, VehicleState
from quad_node.handshake import interface_hash

CLIMB, WHOLE = 2.0, 3.0  # s, s
EVERY = 5  # plant steps between two references
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STEPS = QoSProfile(depth=256)


class Climb(Node):
    """Sends its status, one plan, and a reference for every fifth state."""

    def __init__(self):
        super().__init__("trajectory")
        self.run_id = self.declare_parameter("flight.run_id", "").value
        self.run = {"run": zlib.crc32(self.run_id.encode())}  # whose messages these are
        self.period = self.declare_parameter("flight.plant_period", 2_000_000).value
        self.height = self.declare_parameter("height", 0.5).value  # m: a parameter of your own
        self.first, self.due, self.over = None, 0, Future()
        self.reference_out = self.create_publisher(TrajectoryPoint, "reference", STEPS)
        self.plan_out = self.create_publisher(FlightPlan, "flight/plan", LATCHED)
        self.status_out = self.create_publisher(NodeStatus, "flight/nodes", LATCHED)
        self.create_subscription(VehicleState, "state", self.on_state, STEPS)
        self.create_subscription(FlightState, "flight/state", self.on_flight, LATCHED)
        fields = {
            "node": self.get_fully_qualified_name(),
            "role": "trajectory",
            "run_id": self.run_id,
            "interface_hash": interface_hash(),
        }
        fields |= {"state": NodeStatus.READY, "period_steps": EVERY, "plant_period": self.period}
        self.status_out.publish(NodeStatus(**fields))

    def on_state(self, message):
        if self.first is None:
            self.first = message
            end_step = message.step + round(WHOLE * 1e9 / self.period)
            end = rclpy.time.Time(nanoseconds=end_step * self.period).to_msg()
            plan = {"trajectory": "climb", "start": "approach", "end_step": end_step, "end": end, **self.run}
            self.plan_out.publish(FlightPlan(stamp=message.stamp, trajectory_start=message.stamp, **plan))
        if message.step >= self.due:
            self.due = message.step + EVERY
            self.reference_out.publish(self.point(message))

    def point(self, message):
        time = (message.step - self.first.step) * self.period * 1e-9
        w = math.pi / CLIMB
        angle = min(w * time, math.pi)
        x, y, z = self.first.p_w
        p = [x, y, z + 0.5 * self.height * (1.0 - math.cos(angle))]
        v = [0.0, 0.0, 0.5 * self.height * w * math.sin(angle)]
        a = [0.0, 0.0, 0.5 * self.height * w * w * math.cos(angle) if angle < math.pi else 0.0]
        key = {"stamp": message.stamp, "step": message.step, "next_step": message.step + EVERY, **self.run}
        return TrajectoryPoint(trajectory_time=time, p_w=p, v_w=v, a_w=a, **key)

    def on_flight(self, message):
        if message.run == self.run["run"] and message.state in (FlightState.ENDED, FlightState.FAILED):
            self.over.set_result(0 if message.state == FlightState.ENDED else 1)


def main():
    """Answer states until the flight is over; exit code 0 if it ended well, else 1."""
    rclpy.init()
    node = Climb()
    try:
        rclpy.spin_until_future_complete(node, node.over)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        return 1
    return node.over.result()


if __name__ == "__main__":
    raise SystemExit(main())
