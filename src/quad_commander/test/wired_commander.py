"""A commander whose topics are functions, for tests of its node."""

import zlib
from functools import partial
from types import SimpleNamespace

from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import BatteryState

from quad_commander.node import Commander
from quad_core.types import NOT_BEGUN
from quad_msgs import msg
from quad_msgs.msg import FlightEvent, FlightMode, FlightRequest, TrajectoryPoint
from quad_node.codec import set_stamp

PERIOD = 2_000_000
RUN_ID = "a1"
RUN = zlib.crc32(RUN_ID.encode())


class Wire:
    """Stands in for a publisher and keeps what was sent."""

    def __init__(self, kind):
        self.sent, self._kind = [], kind

    def publish(self, message):
        self.sent.append(deserialize_message(message, self._kind) if isinstance(message, bytes) else message)


class Wired(Commander):
    """A commander whose topics are functions."""

    def __init__(self, callbacks):
        self.callbacks, self.events, self.publishing = callbacks, [], 1
        super().__init__()
        log = self.node.events
        log.info, log.warn = partial(self.note, FlightEvent.INFO), partial(self.note, FlightEvent.WARNING)
        self._reference_out, self._mode_out, self._mode_shown = map(Wire, (TrajectoryPoint, FlightMode, FlightMode))
        self.modes, self.references = self._mode_out.sent, self._reference_out.sent
        self.node.ros.count_publishers = lambda _: self.publishing
        self.node.ros.get_publishers_info_by_topic = lambda _: [
            SimpleNamespace(node_namespace="/", node_name=f"node_{number}") for number in range(self.publishing)
        ]

    def note(self, severity, kind, text, stamp_ns=0, always=False):
        self.events.append((severity, kind, text))

    def state(self, step, z=0.0):
        message = msg.VehicleState(step=step, run=RUN)
        message.p_w[2], message.q_wb[3] = z, 1.0
        set_stamp(message.stamp, step * PERIOD)
        self.callbacks["state"](serialize_message(message))

    def mission(self, step, trajectory_time=NOT_BEGUN, length=5):
        point = TrajectoryPoint(step=step, run=RUN, next_step=step + length, trajectory_time=trajectory_time)
        self.callbacks["mission/reference"](serialize_message(point))

    def guard(self, step, run=RUN, **seen):
        self.callbacks["flight/guard"](serialize_message(msg.GuardStatus(step=step, run=run, **seen)))

    def setpoint(self, step, run=RUN):
        self.callbacks["attitude_setpoint"](serialize_message(msg.AttitudeThrust(step=step, run=run)))

    def plan(self, high=2.0, run=RUN):
        plan = msg.FlightPlan(trajectory="hover", end_step=5000, run=run)
        plan.high[2] = high
        self.callbacks["flight/plan"](plan)

    def fly(self, first, last, **seen):
        """Answer the states of the plant steps from ``first`` to before ``last``, all inputs there.

        ``seen`` is what the guard reports.
        """
        for step in range(first, last):
            self.callbacks["wrench_setpoint"](b"")
            if step % 5 == 0:
                self.setpoint(step)
                self.mission(step)
            if step:
                self.guard(step - 1, **seen)
            self.state(step)

    def ask(self, request, sender="pilot", run=0):
        self.callbacks["flight/request"](FlightRequest(request=request, sender=sender, run=run))

    def battery(self, percentage):
        self.callbacks["battery_state"](BatteryState(percentage=percentage))


def wired(start_node, callbacks, *parameters):
    """Return the node with the given ROS parameters, made by the fixture ``start_node``, with ``callbacks``."""
    roles = "flight.roles:=simulator,trajectory,commander,position_controller,attitude_controller,recorder"
    node = start_node(lambda: Wired(callbacks), roles, f"flight.run_id:={RUN_ID}", *parameters)
    for role, period in (("position_controller", 5), ("attitude_controller", 1)):
        status = msg.NodeStatus(node=f"/{role}", role=role, run_id=RUN_ID, interface_hash="x", period_steps=period)
        node.callbacks["flight/nodes"](status)
    return node
