"""The node: it takes the command and publishes ``state`` and ``actuation`` of its vehicle, in real time.

scripts/fly hover --realtime --vehicle-owner my_vehicle=FILE
"""

import sys
import time
from typing import Any

from my_vehicle_interface.craft import Craft
from my_vehicle_interface.interface import ROLE
from quad_core.cycle import is_flyable, seconds
from quad_core.types import Actuation, VehicleState
from quad_guard.checks import StateSample, WrenchCommand
from quad_guard.ending import is_down
from quad_msgs.msg import FlightState
from quad_node.codec import packer
from quad_node.main import run
from quad_node.topics import message_type
from quad_node.vehicle_node import VehicleNode


class MyBridge(VehicleNode):
    """Flies the craft with the newest wrench that the guard lets through."""

    def __init__(self) -> None:
        """Make the craft and the publishers; raises as FlightNode."""
        super().__init__(ROLE)
        self._craft = Craft(self.vehicle, self.resolved.node.drag)
        self._outputs = {
            topic: (self.publisher(topic), packer(kind, message_type(kind), self.run))
            for topic, kind in (("state", VehicleState), ("actuation", Actuation))
        }
        self._timer: Any = None
        self._clock_start = 0.0
        self._used = -1

    def begin(self) -> None:
        """Publish step 0, which the controllers answer."""
        self._publish("state", self._craft.state)

    def progress(self) -> None:
        """Start the clock with the first command; until then the vehicle rests."""
        if self.phase != FlightState.FLYING or self._timer is not None or self.command is None:
            return
        self._clock_start = time.monotonic()
        self._timer = self.every(seconds(1, self.flight.plant_period), self._on_period)

    def _on_period(self) -> None:
        due = int((time.monotonic() - self._clock_start) * 1e9) // self.flight.plant_period
        while self.phase == FlightState.FLYING and self.current_step < due:
            self._fly()

    def _fly(self) -> None:
        step, period = self.current_step, self.flight.plant_period
        sample = StateSample(self._craft.state, step, True)
        received = WrenchCommand()
        if self.command is not None and not self.gives_up:
            answered = self.command.step
            received = WrenchCommand(self.command.value, answered, answered > self._used)
            self._used = answered
        wrench = self.guarded(received, sample)
        self._craft.advance(wrench, seconds(1, period))
        self._publish("actuation", Actuation(thrust=wrench.thrust, torque_b=wrench.torque_b))
        state = self._craft.state
        if not is_flyable(state):
            self.end(FlightState.FAILED, "diverged: the state left its bounds")
        elif self.guard.taken_over and is_down(self.guard.parameters, self.guard.memory, state, False):
            self.end(FlightState.FAILED, f"{self.failure}; down at step {step + 1}")
        elif self.end_step and step + 1 >= self.end_step:
            self.end(FlightState.FAILED if self.guard.taken_over else FlightState.ENDED, self.failure)
        else:
            self.current_step += 1
            self._publish("state", state)

    def _publish(self, topic: str, value: Any) -> None:
        publisher, pack = self._outputs[topic]
        if topic == "state":
            self.asked_at = time.monotonic()
        publisher.publish(pack(value, self.current_step, self.current_step + 1, self.elapsed_ns))


def main() -> None:
    """Run the node."""
    sys.exit(run(ROLE, MyBridge, "A vehicle of your own: takes the command, publishes state and actuation."))
