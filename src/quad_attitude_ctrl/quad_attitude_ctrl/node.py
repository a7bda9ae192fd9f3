"""The attitude controller node (eqs. 39-60 for abfnitsm).

Subscribes: state (VehicleState), attitude_setpoint (AttitudeThrust), actuation (Actuation).
Publishes: wrench_setpoint (WrenchStamped), attitude_controller/internals (AttitudeInternals).
Topics that every node has: ``quad_node.flight_node``.
"""

import sys

from quad_core.cascade import ATTITUDE
from quad_node.law_node import LawNode
from quad_node.main import run


def make() -> LawNode:
    """Return the node of any attitude law; raises as LawNode does."""
    return LawNode(ATTITUDE)


def main() -> None:
    """Run the attitude controller node."""
    sys.exit(run(ATTITUDE, make, "Attitude controller: answers state with wrench_setpoint."))
