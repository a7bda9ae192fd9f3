"""The position controller node (eqs. 18-38 for aibs).

Subscribes: state (VehicleState), reference (TrajectoryPoint), actuation (Actuation).
Publishes: attitude_setpoint (AttitudeThrust), position_controller/internals (PositionInternals).
Topics that every node has: ``quad_node.flight_node``.
"""

import sys
from collections.abc import Callable

from quad_core.cascade import POSITION
from quad_core.cycle import ReferenceLag, followed, lag_check, limits_met
from quad_core.geometry import norm
from quad_core.types import PositionInternals
from quad_node.law_node import LawNode
from quad_node.main import run
from quad_node.responder import Sample


def reach_check(node: LawNode) -> Callable[[PositionInternals, Sample], None]:
    """Return what sends one event when the law, at a limit, comes no nearer to its reference for INFEASIBLE_TIME."""
    distance_behind, behind = lag_check(node.law.module.Internals), ReferenceLag()

    def check(internals: PositionInternals, sample: Sample) -> None:
        nonlocal behind
        before, behind = behind, followed(behind, distance_behind(internals), sample.stamp_ns)
        if behind.infeasible_ns == before.infeasible_ns or node.node.shadow:
            return
        error, stuck = norm(internals.position_error), (sample.stamp_ns - before.nearer_ns) / 1e9
        text = (
            f"{error:.2f} m from the reference and no nearer for {stuck:.1f} s, "
            f"at the {limits_met(internals)} limit of {node.law.name}"
        )
        node.node.events.warn("infeasible_reference", text)

    return check


def make() -> LawNode:
    """Return the node of any position law; raises as LawNode does."""
    node = LawNode(POSITION)
    node.on_internals = reach_check(node)
    return node


def main() -> None:
    """Run the position controller node."""
    sys.exit(run(POSITION, make, "Position controller: answers state with attitude_setpoint."))
