"""The position controller node: state and reference in, attitude setpoint out (eqs. 18-38 for aibs)."""

import sys

from quad_core.cascade import POSITION
from quad_core.cycle import Behind, behind_check, followed
from quad_core.geometry import norm
from quad_core.types import PositionInternals
from quad_msgs.msg import FlightEvent
from quad_node.law_node import LawNode
from quad_node.main import run
from quad_node.responder import Sample


class PositionController(LawNode):
    """The node of any position law; it says when a reference asks for more than the vehicle has."""

    def __init__(self) -> None:
        """Create the node. Raises as LawNode does."""
        super().__init__(POSITION)
        self.is_behind = behind_check(self.law.module.Internals)
        self._behind = Behind()

    def on_internals(self, internals: PositionInternals, sample: Sample) -> None:
        """Send one event when the law is at a limit and far from its reference for longer than INFEASIBLE_TIME."""
        before = self._behind
        self._behind = followed(before, self.is_behind(internals), sample.stamp_ns)
        if self._behind.infeasible_ns == before.infeasible_ns or self.shadow:
            return
        error, behind = norm(internals.position_error), (sample.stamp_ns - before.since_ns) / 1e9
        text = f"{error:.2f} m from the reference, at a limit of {self.law.name} for {behind:.1f} s"
        self.event(FlightEvent.WARNING, "infeasible_reference", text)


def main() -> None:
    """Run the position controller node."""
    sys.exit(run(POSITION, PositionController, "Position controller: answers state with attitude_setpoint."))
