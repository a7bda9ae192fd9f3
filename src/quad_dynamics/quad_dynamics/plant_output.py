"""What whoever integrates a plant publishes of each step: state, truth, disturbance, actuation, and for tools."""

from typing import Any

from quad_core.cascade import SIGNALS
from quad_core.geometry import rotate_inverse
from quad_dynamics.plant_model import PlantModel
from quad_msgs.msg import FlightEvent
from quad_node.codec import Packer, pack_clock, pack_odometry, packer
from quad_node.flight_node import FlightNode
from quad_node.topics import message_type


def announce(node: FlightNode, model: PlantModel, step: int, stamp: int) -> None:
    """Report as events of ``node`` what begins or ends to act on ``model`` at ``step``; ``stamp`` in ns."""
    for kind, text in model.announced(step):
        node.event(FlightEvent.INFO, kind, text, stamp, always=True)


class PlantOutput:
    """Publishes what a ``PlantModel`` does."""

    def __init__(self, node: FlightNode, model: PlantModel) -> None:
        """Make the publishers on ``node``."""
        self._node, self._model = node, model
        self._state_out = self._output("state") if node.resolved.node.publish_state else None
        self._truth_out = self._output("truth")
        self._actuation_out = self._output("actuation")
        self._disturbance_out = self._output("disturbance")
        self._settings = node.resolved.node
        self._odom_out = node.publisher("odom", match=self._state_out is None)
        self._clock_out = node.publisher("clock", match=False)

    def _output(self, topic: str) -> tuple[Any, Packer]:
        kind = SIGNALS[topic].kind
        return self._node.publisher(topic), packer(kind, message_type(kind), self._node.run)

    def publish(self, step: int, stamp: int) -> None:
        """Publish the state of ``step`` first, then what no controller waits for; ``stamp`` in ns."""
        model = self._model
        if self._state_out is None:
            self._publish_for_tools(step, stamp)
        else:
            _send(self._state_out, model.state, step, stamp)
        # what no controller waits for goes out while they compute
        _send(self._truth_out, model.truth, step, stamp)
        _send(self._disturbance_out, model.disturbance(), step, stamp)
        if self._state_out is not None:
            self._publish_for_tools(step, stamp)

    def show(self) -> None:
        """Publish for tools, and for an estimator, how the vehicle waits for step 0."""
        self._publish_for_tools(0, 0)

    def _publish_for_tools(self, step: int, stamp: int) -> None:
        """Publish odom (pose in map, twist in base_link) and clock, where they are due; no control depends on them."""
        state = self._model.state
        if step % self._settings.clock_period_steps == 0:
            self._clock_out.publish(pack_clock(stamp))
        if step % self._settings.odom_period_steps == 0:
            self._odom_out.publish(pack_odometry(state, rotate_inverse(state.q_wb, state.v_w), stamp))

    def publish_actuation(self) -> None:
        """Publish what the rotors made of the last step's command."""
        step = self._model.actuated_step
        _send(self._actuation_out, self._model.actuation, step, step * self._node.flight.plant_period)


def _send(output: tuple[Any, Packer], value: Any, step: int, stamp: int) -> None:
    publisher, pack = output
    publisher.publish(pack(value, step, step + 1, stamp))
