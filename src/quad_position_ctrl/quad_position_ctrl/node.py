"""The position controller node: state and reference in, attitude setpoint out."""

import sys
from typing import Any

from rclpy.publisher import Publisher

from quad_core.safe import hold_position
from quad_core.types import Actuation, AttitudeThrust, PositionInputs, TrajectoryPoint
from quad_msgs.msg import AttitudeThrust as AttitudeThrustMsg
from quad_msgs.msg import PositionInternals
from quad_node import topics
from quad_node.conversion import writer
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
        self._write = writer(AttitudeThrust, AttitudeThrustMsg)
        self._message = AttitudeThrustMsg()

    def answer(self, moment: Moment, values: list[Held | None]) -> list[tuple[Publisher, Any]]:
        """Return the attitude setpoint and the law's internals of one step."""
        held, actuation = values
        assert held is not None
        reference = held.value
        if not self.lockstep and age(held) > self.resolved.node.input_timeout:
            reference = hold_position(reference)
            self.stale("reference", held)
        inputs = PositionInputs(moment.state, reference, actuation.value if actuation else Actuation())
        setpoint = self.run_law(inputs, moment)
        if setpoint is None:
            return []
        self._write(setpoint, self._message)
        self.stamp(self._message, moment)
        self._message.next_step = moment.step + self.period_steps
        return [(self._setpoint_out, self._message), self.internals_answer()]


def main() -> None:
    """Run the position controller node."""
    sys.exit(run(topics.POSITION, PositionController, "Position controller: answers state with attitude_setpoint."))
