"""A responder whose topics are functions and that notes what it answers, for tests of which states a node answers."""

import rclpy
from rclpy.serialization import serialize_message

from quad_msgs import msg
from quad_node import executor
from quad_node.conversion import set_stamp
from quad_node.responder import Responder

PERIOD = 2_000_000


class Wire:
    """Stands in for a publisher and keeps what was sent."""

    def __init__(self):
        self.sent = []

    def publish(self, message):
        self.sent.append(message)


class Echo(Responder):
    """Notes each sample; its answer is the number of samples so far."""

    def __init__(self):
        self.callbacks = {}
        super().__init__("position_controller")
        self.wire, self.samples = Wire(), []
        self.take("reference")
        self.take("actuation", lag=1)

    def subscribe(self, topic, callback, depth=10, raw=False):
        self.callbacks[topic] = callback

    def answer(self, sample, arrivals):
        self.samples.append((sample, [arrival.value if arrival else None for arrival in arrivals]))
        return [(self.wire, len(self.samples))]

    def state(self, step, x=0.0, stamp=None, run=0):
        message = msg.VehicleState(step=step, run=run)
        message.p_w[0], message.q_wb[3] = x, 1.0
        set_stamp(message.stamp, step * PERIOD if stamp is None else stamp)
        self.callbacks["state"](serialize_message(message))

    def reference(self, step, next_step, x=0.0, run=0):
        message = msg.TrajectoryPoint(step=step, next_step=next_step, run=run)
        message.p_w[0] = x
        self.callbacks["reference"](serialize_message(message))

    def actuation(self, step, thrust=0.0):
        self.callbacks["actuation"](serialize_message(msg.Actuation(step=step, thrust=thrust)))

    def steps(self):
        return [sample.step for sample, _ in self.samples]


def echoes(monkeypatch):
    """Yield a function that makes the node with the given ROS parameters; for a fixture."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "71")
    made = []

    def build(*parameters):
        executor.init(["--ros-args", *(part for text in parameters for part in ("-p", text))])
        made.append(Echo())
        return made[-1]

    yield build
    for node in made:
        node.ros.destroy_node()
    rclpy.try_shutdown()
