"""The position controller node: state and reference in, attitude setpoint out (eqs. 18-38 for aibs)."""

import sys
from functools import partial

from quad_core.cascade import POSITION
from quad_node.law_node import LawNode
from quad_node.main import run


def main() -> None:
    """Run the position controller node."""
    sys.exit(run(POSITION, partial(LawNode, POSITION), "Position controller: answers state with attitude_setpoint."))
