"""The node: it takes the command and publishes ``state`` and ``actuation`` of its vehicle, in real time.

scripts/fly hover --realtime --vehicle-interface my_vehicle=FILE
"""

import sys
import time
from typing import Any

from my_vehicle_interface.craft import Craft
from my_vehicle_interface.interface import ROLE
from quad_core.cycle import is_flyable, seconds
from quad_core.types import Actuation
from quad_guard.checks import StateSample, WrenchCommand
from quad_guard.ending import is_down
from quad_msgs.msg import FlightState
from quad_node.flight_leader import FlightLeader
from quad_node.flight_node import FlightNode
from quad_node.main import run


class MyBridge:
    """Flies the craft with the newest wrench that the guard lets through."""

    def __init__(self) -> None:
        """Make the craft and the publishers; raises as FlightNode."""
        self.node = FlightNode(ROLE, watch=self._watch, deactivate=self.deactivate)
        self.leader = FlightLeader(self.node, activate=self.activate, progress=self._progress)
        self._craft = Craft(self.node.vehicle, self.node.settings.drag)
        self._outputs = {topic: self.leader.output(topic) for topic in ("state", "actuation")}
        self._period = self.node.flight.plant_period
        self._timer: Any = None
        self._clock_start = 0.0
        self._used = -1

    def activate(self) -> None:
        """Publish step 0, which the controllers answer."""
        self._publish("state", self._craft.state)

    def _progress(self) -> None:
        """Start the clock with the first command; until then the vehicle rests."""
        if self.node.flying and self._timer is None and self.leader.wrenches.newest is not None:
            self._clock_start = time.monotonic()
            self._timer = self.node.every(seconds(1, self._period), self._on_period)

    def _on_period(self) -> None:
        due = int((time.monotonic() - self._clock_start) * 1e9) // self._period
        while self.node.flying and self.node.current_step < due:
            self.step()

    def step(self) -> None:
        """Fly for one period."""
        leader, step = self.leader, self.node.current_step
        sample = StateSample(self._craft.state, step, True)
        received, newest = WrenchCommand(), leader.wrenches.newest
        if newest is not None and not leader.gives_up:
            received = WrenchCommand(newest.value, newest.step, newest.step > self._used)
            self._used = newest.step
        wrench = leader.guarded(received, sample)
        self._craft.advance(wrench, seconds(1, self._period))
        self._publish("actuation", Actuation(thrust=wrench.thrust, torque_b=wrench.torque_b))
        state, guard = self._craft.state, leader.guard
        if not is_flyable(state):
            leader.end(FlightState.FAILED, "diverged: the state left its bounds")
        elif guard.taken_over and is_down(guard.parameters, guard.memory, state, False):
            leader.end(FlightState.FAILED, f"{leader.failure}; down at step {step + 1}")
        elif leader.end_step and step + 1 >= leader.end_step:
            leader.end(FlightState.FAILED if guard.taken_over else FlightState.ENDED, leader.failure)
        else:
            self.node.current_step += 1
            self._publish("state", state)

    def _watch(self) -> None:
        self.leader.watch()

    def deactivate(self, ended: FlightState) -> None:
        """End the flight because of a signal."""
        self.leader.end(ended.state, ended.reason)

    def _publish(self, topic: str, value: Any) -> None:
        publisher, pack = self._outputs[topic]
        step = self.node.current_step
        if topic == "state":
            self.leader.asks()
        publisher.publish(pack(value, step, step + 1, self.leader.elapsed_ns))


def main() -> None:
    """Run the node."""
    sys.exit(run(ROLE, MyBridge, "A vehicle of your own: takes the command, publishes state and actuation."))
