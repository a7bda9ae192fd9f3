"""The position controller node: state and reference in, attitude setpoint out (eqs. 18-38 for aibs)."""

import sys

from quad_core.cascade import POSITION
from quad_core.cycle import Behind, behind_check, followed, limits_met
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
        self.distance_behind = behind_check(self.law.module.Internals)
        self._behind = Behind()

    def on_internals(self, internals: PositionInternals, sample: Sample) -> None:
        """Send one event when the law, at a limit, has come no nearer to its reference for INFEASIBLE_TIME."""
        before = self._behind
        self._behind = followed(before, self.distance_behind(internals), sample.stamp_ns)
        if self._behind.infeasible_ns == before.infeasible_ns or self.shadow:
            return
        error, stuck = norm(internals.position_error), (sample.stamp_ns - before.nearer_ns) / 1e9
        text = (
            f"{error:.2f} m from the reference and no nearer for {stuck:.1f} s, "
            f"at the {limits_met(internals)} limit of {self.law.name}"
        )
        self.event(FlightEvent.WARNING, "infeasible_reference", text)


def main() -> None:
    """Run the position controller node."""
    sys.exit(run(POSITION, PositionController, "Position controller: answers state with attitude_setpoint."))
