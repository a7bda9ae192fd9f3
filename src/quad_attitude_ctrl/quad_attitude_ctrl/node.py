"""The attitude controller node: state and attitude setpoint in, wrench out (eqs. 39-60 for abfnitsm)."""

import sys
from functools import partial

from quad_core.cascade import ATTITUDE
from quad_node.law_node import LawNode
from quad_node.main import run


def main() -> None:
    """Run the attitude controller node."""
    sys.exit(run(ATTITUDE, partial(LawNode, ATTITUDE), "Attitude controller: answers state with wrench_setpoint."))
