"""The trajectory node: plans at the first state, then publishes the reference of each of its steps."""

import sys
from collections.abc import Iterator
from typing import Any

from rclpy.publisher import Publisher

from quad_core.parameters import Choice, fields
from quad_core.timing import seconds, steps_to_cover
from quad_core.types import TrajectoryPoint
from quad_msgs.msg import FlightPlan
from quad_msgs.msg import TrajectoryPoint as TrajectoryPointMsg
from quad_node import topics
from quad_node.codec import packer
from quad_node.conversion import set_stamp
from quad_node.main import run
from quad_node.responder import Held, Moment, Responder


class Trajectory(Responder):
    """Samples one trajectory plug-in."""

    def __init__(self) -> None:
        """Load the trajectory named by the parameters; raises as FlightNode."""
        super().__init__(topics.TRAJECTORY)
        self._plugin = self.resolved.plugins["trajectory"]
        self._plan: Any = None
        self._first_stamp = 0
        self._plan_out = self.publisher("flight/plan")
        self._reference_out = self.publisher("reference")
        self._pack = packer(TrajectoryPoint, TrajectoryPointMsg)

    def answer(self, moment: Moment, values: list[Held | None]) -> Iterator[tuple[Publisher, Any]]:  # noqa: ARG002
        """Give the reference of one step, and before the first one the plan."""
        if self._plan is None:
            yield self._plan_out, self._make_plan(moment)
        time = seconds(moment.stamp_ns - self._first_stamp, 1)
        point = self._plugin.module.sample(self._plugin.parameters, self._plan, time)
        next_step = moment.step + self.period_steps
        yield self._reference_out, self._pack(point, moment.step, next_step, moment.stamp_ns)

    def _make_plan(self, moment: Moment) -> FlightPlan:
        module, parameters = self._plugin.module, self._plugin.parameters
        self._plan = module.plan(parameters, self.vehicle, moment.state)
        self._first_stamp = moment.stamp_ns
        approach = -module.sample(parameters, self._plan, 0.0).trajectory_time
        length = module.duration(parameters, self._plan)
        end_step = moment.step + steps_to_cover(length, self.flight.plant_period)
        message = FlightPlan(trajectory=self._plugin.name, start=self._start_mode(), end_step=end_step)
        set_stamp(message.stamp, moment.stamp_ns)
        set_stamp(message.trajectory_start, moment.stamp_ns + round(approach * 1e9))
        set_stamp(message.end, end_step * self.flight.plant_period)
        return message

    def _start_mode(self) -> str:
        for field in fields(self._plugin.parameters):
            if field.name == "start" and isinstance(field.spec, Choice):
                return str(field.default)
        return "approach"


def main() -> None:
    """Run the trajectory node."""
    sys.exit(run(topics.TRAJECTORY, Trajectory, "Reference generator: answers state with reference (eqs. 61-68)."))
