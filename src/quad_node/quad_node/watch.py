"""Follow a flight from outside, without taking part in it."""

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from quad_msgs.msg import FlightState
from quad_node import topics


class FlightWatch:
    """The newest ``flight/state`` of one run in one domain and namespace."""

    def __init__(self, run_id: str, domain: int, namespace: str = "") -> None:
        """Join ``domain``; a process may watch several flights one after the other."""
        self.newest: FlightState | None = None
        self._run_id = run_id
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node(
            "flight_watch",
            context=self._context,
            namespace=namespace,
            enable_rosout=False,
            start_parameter_services=False,
        )
        entry = topics.TOPICS["flight/state"]
        self._node.create_subscription(entry.type, entry.name, self._on_state, entry.qos())
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def poll(self, seconds: float) -> FlightState | None:
        """Wait up to ``seconds`` for news and return the newest state of the run, None before the first."""
        self._executor.spin_once(timeout_sec=seconds)
        return self.newest

    def close(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def _on_state(self, message: FlightState) -> None:
        if message.run_id == self._run_id:
            self.newest = message
