"""The position controller node: state and reference in, attitude setpoint out."""

import sys
from collections.abc import Iterator

from rclpy.publisher import Publisher

from quad_core.safe import hold_position
from quad_core.types import Actuation, AttitudeThrust, PositionInputs, TrajectoryPoint
from quad_msgs.msg import AttitudeThrust as AttitudeThrustMsg
from quad_msgs.msg import PositionInternals
from quad_node import topics
from quad_node.codec import packer
from quad_node.law_node import LawNode
from quad_node.main import run
from quad_node.responder import Held, Moment, age


class PositionController(LawNode):
    """Runs one position law (eqs. 18-38 for aibs)."""

    def __init__(self) -> None:
        """Load the law named by the parameters; raises as FlightNode."""
        super().__init__(topics.POSITION, PositionInternals)
        self.companion("reference", TrajectoryPoint)
        self.companion("actuation", Actuation, lag=1)
        self._setpoint_out = self.publisher("attitude_setpoint")
        self._pack = packer(AttitudeThrust, AttitudeThrustMsg)

    def answer(self, moment: Moment, values: list[Held | None]) -> Iterator[tuple[Publisher, bytes]]:
        """Give the attitude setpoint and the law's internals of one step."""
        held, actuation = values
        assert held is not None
        reference = held.value
        if not self.lockstep and age(held) > self.resolved.node.input_timeout:
            reference = hold_position(reference)
            self.stale("reference", held)
        inputs = PositionInputs(moment.state, reference, actuation.value if actuation else Actuation())
        setpoint = self.run_law(inputs, moment)
        if setpoint is None:
            return
        next_step = moment.step + self.period_steps
        yield self._setpoint_out, self._pack(setpoint, moment.step, next_step, moment.stamp_ns)
        yield self.internals_answer(moment)


def main() -> None:
    """Run the position controller node."""
    sys.exit(run(topics.POSITION, PositionController, "Position controller: answers state with attitude_setpoint."))
