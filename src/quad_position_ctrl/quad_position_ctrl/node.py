"""The position controller node (eqs. 18-38 for aibs).

Subscribes: state (VehicleState), reference (TrajectoryPoint), actuation (Actuation).
Publishes: attitude_setpoint (AttitudeThrust), position_controller/internals (PositionInternals).
A standby also has flight/takeover; topics that every node has: ``quad_node.flight_node``.
"""

import sys

from quad_core.cascade import POSITION
from quad_core.cycle import Behind, behind_check, followed, limits_met
from quad_core.geometry import norm
from quad_core.types import PositionInternals
from quad_msgs.msg import FlightEvent
from quad_node.main import run
from quad_node.responder import LawNode, Sample


class ReachCheck:
    """Tells when a reference asks for more than the vehicle has."""

    def __init__(self, node: LawNode) -> None:
        """Check the answers of ``node``."""
        self._node = node
        self._distance_behind = behind_check(node.law.module.Internals)
        self._behind = Behind()

    def __call__(self, internals: PositionInternals, sample: Sample) -> None:
        """Send one event when the law, at a limit, has come no nearer to its reference for INFEASIBLE_TIME."""
        before = self._behind
        self._behind = followed(before, self._distance_behind(internals), sample.stamp_ns)
        if self._behind.infeasible_ns == before.infeasible_ns or self._node.shadow:
            return
        error, stuck = norm(internals.position_error), (sample.stamp_ns - before.nearer_ns) / 1e9
        text = (
            f"{error:.2f} m from the reference and no nearer for {stuck:.1f} s, "
            f"at the {limits_met(internals)} limit of {self._node.law.name}"
        )
        self._node.event(FlightEvent.WARNING, "infeasible_reference", text)


def make() -> LawNode:
    """Return the node of any position law; raises as LawNode does."""
    node = LawNode(POSITION)
    node.on_internals = ReachCheck(node)
    return node


def main() -> None:
    """Run the position controller node."""
    sys.exit(run(POSITION, make, "Position controller: answers state with attitude_setpoint."))
