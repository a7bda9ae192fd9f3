"""The torque filter node: wrench in, filtered wrench out."""

import sys
from functools import partial

from quad_node.law_node import LawNode
from quad_node.main import run

ROLE = "torque_filter"


def main() -> None:
    """Run the torque filter node."""
    sys.exit(run(ROLE, partial(LawNode, ROLE), "Torque filter: answers wrench_setpoint with wrench_filtered."))
