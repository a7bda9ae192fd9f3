"""The attitude controller node: state and attitude setpoint in, wrench out."""

import sys
from collections.abc import Iterator

from rclpy.publisher import Publisher

from quad_core.safe import level_hover
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust
from quad_msgs.msg import AttitudeInternals
from quad_node import topics
from quad_node.codec import pack_wrench
from quad_node.law_node import LawNode
from quad_node.main import run
from quad_node.responder import Held, Moment, age


class AttitudeController(LawNode):
    """Runs one attitude law (eqs. 39-60 for abfnitsm)."""

    def __init__(self) -> None:
        """Load the law named by the parameters; raises as FlightNode."""
        super().__init__(topics.ATTITUDE, AttitudeInternals)
        self.companion("attitude_setpoint", AttitudeThrust)
        self.companion("actuation", Actuation, lag=1)
        self._wrench_out = self.publisher("wrench_setpoint")

    def answer(self, moment: Moment, values: list[Held | None]) -> Iterator[tuple[Publisher, bytes]]:
        """Give the wrench and the law's internals of one step."""
        held, actuation = values
        assert held is not None
        setpoint = held.value
        if not self.lockstep and age(held) > self.resolved.node.input_timeout:
            setpoint = level_hover(self.vehicle, moment.state)
            self.stale("attitude_setpoint", held)
        inputs = AttitudeInputs(moment.state, setpoint, actuation.value if actuation else Actuation())
        wrench = self.run_law(inputs, moment)
        if wrench is None:
            return
        yield self._wrench_out, pack_wrench(wrench, moment.stamp_ns)
        yield self.internals_answer(moment)


def main() -> None:
    """Run the attitude controller node."""
    sys.exit(run(topics.ATTITUDE, AttitudeController, "Attitude controller: answers state with wrench_setpoint."))
