"""Follow a flight from outside, without taking part in it."""

import time
from collections import deque

import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from quad_core.cycle import seconds
from quad_core.enumerations import NodeState
from quad_msgs.msg import FlightEvent, FlightRequest, FlightState, NodeStatus
from quad_node import topics
from quad_node.codec import stamp_ns
from quad_node.executor import destroy
from quad_node.handshake import run_number

NO_FILES = ["--ros-args", "--disable-external-lib-logs"]
"""Arguments of ROS for a process that writes no log file: no folder is needed for one."""
_HUNG = 1  # exit code of a process that hangs while it gives its node back
WAITING, FLYING, ENDED, FAILED = FlightState.WAITING, FlightState.FLYING, FlightState.ENDED, FlightState.FAILED
PHASES = {WAITING: "waiting", FLYING: "flying", ENDED: "ended", FAILED: "failed"}


def is_over(state: FlightState) -> bool:
    """Return whether the flight is over, well or not."""
    return state.state in (ENDED, FAILED)


def node_of_its_own(name: str, domain: int, namespace: str = "") -> Node:
    """Return a node in ``domain`` with a context, and so a participant, of its own."""
    context = Context()
    rclpy.init(args=NO_FILES, context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    return Node(name, context=context, namespace=namespace, enable_rosout=False, start_parameter_services=False)


class FlightWatch:
    """The newest ``flight/state`` of one run in one domain and namespace, and what its nodes say.

    ``news``: (flight time in s, text) of each change of mode, each event of a scenario, and the first warning or error
    of a kind from a node, not taken out yet.
    """

    def __init__(self, run_id: str, domain: int, namespace: str = "") -> None:
        """Join ``domain``; a process may watch several flights one after the other."""
        self.newest: FlightState | None = None
        self.news: deque[tuple[float, str]] = deque()
        self._warned: dict[tuple[str, str], str] = {}
        self._run_id, self._run = run_id, run_number(run_id)
        self._node = node_of_its_own("flight_watch", domain, namespace)
        entry = topics.TOPICS["flight/state"]
        self._states = self._node.create_subscription(entry.type, entry.name, self._on_state, entry.qos())
        entry = topics.TOPICS["flight/events"]
        self._node.create_subscription(entry.type, entry.name, self._on_event, entry.qos())
        entry = topics.TOPICS["flight/nodes"]
        self._statuses: dict[str, NodeStatus] = {}
        self._node.create_subscription(entry.type, entry.name, self._on_status, entry.qos(64))
        self._status_out = self._node.create_publisher(entry.type, entry.name, entry.qos())
        self._executor = SingleThreadedExecutor(context=self._node.context)
        self._executor.add_node(self._node)

    def poll(self, patience: float) -> FlightState | None:
        """Wait up to ``patience`` s for news and return the newest state of the run, None before the first."""
        self._executor.spin_once(timeout_sec=patience)
        # A flight that is found late tells all it has said, the oldest first.
        while (taken := self._states.handle.take_message(FlightState, False)) is not None:
            self._on_state(taken[0])
        return self.newest

    def ask_to_end(self, why: str, patience: float = 1.0) -> None:
        """Ask a commander to land and end the flight because of ``why``; it has ``patience`` s to be found."""
        entry = topics.TOPICS["flight/request"]
        requests = self._node.create_publisher(entry.type, entry.name, entry.qos())
        deadline = time.monotonic() + patience
        while not requests.get_subscription_count() and time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=0.02)
        requests.publish(FlightRequest(request=FlightRequest.END, run=self._run, sender=why))
        requests.wait_for_all_acked(Duration(seconds=patience))

    def report_failure(self, role: str, how: str) -> None:
        """Publish the status FAULT in the place of a node whose process has ended; ``how`` it did."""
        status = self._statuses.get(role)
        if status is not None and status.state not in (NodeState.FAULT, NodeState.DONE):
            status.state, status.detail = NodeState.FAULT, how
            self._status_out.publish(status)

    def close(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        destroy(self._node, _HUNG)
        self._node.context.try_shutdown()

    def _on_event(self, message: FlightEvent) -> None:
        time_, source = seconds(stamp_ns(message.stamp), 1), (message.node, message.kind)
        acts = message.text.startswith(("begins: ", "ends: "))  # an event of the scenario
        if acts or message.kind in ("mode", "request_refused"):
            self.news.append((time_, message.text))
        elif message.severity != FlightEvent.INFO and source not in self._warned:
            is_repeated = any(text in message.text for text in self._warned.values())  # what follows from it
            self._warned[source] = message.text
            if not is_repeated:
                self.news.append((time_, f"{message.node.rpartition('/')[2]}: {message.text}"))

    def _on_status(self, message: NodeStatus) -> None:
        if message.run_id == self._run_id:
            self._statuses[message.role] = message

    def _on_state(self, message: FlightState) -> None:
        if message.run == self._run:
            self.newest = message
