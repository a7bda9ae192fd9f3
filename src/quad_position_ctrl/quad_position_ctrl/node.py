"""The position controller node: state and reference in, attitude setpoint out (eqs. 18-38 for aibs)."""

import sys

from quad_core.cascade import POSITION
from quad_core.extent import INFEASIBLE_ERROR, INFEASIBLE_TIME, LIMIT_FLAGS
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
        self._behind_since: int | None = None
        self._said_infeasible = False

    def on_internals(self, internals: PositionInternals, sample: Sample) -> None:
        """Send one event when the law is at a limit and far from its reference for longer than INFEASIBLE_TIME."""
        error = norm(internals.position_error)
        if not (error > INFEASIBLE_ERROR and any(getattr(internals, flag) for flag in LIMIT_FLAGS)):
            self._behind_since = None
            return
        if self._behind_since is None:
            self._behind_since = sample.stamp_ns
        behind = (sample.stamp_ns - self._behind_since) * 1e-9
        if behind > INFEASIBLE_TIME and not (self._said_infeasible or self.shadow):
            self._said_infeasible = True
            text = f"{error:.2f} m from the reference, at a limit of {self.law.name} for {behind:.1f} s"
            self.event(FlightEvent.WARNING, "infeasible_reference", text)


def main() -> None:
    """Run the position controller node."""
    sys.exit(run(POSITION, PositionController, "Position controller: answers state with attitude_setpoint."))
