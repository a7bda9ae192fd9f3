"""The attitude controller with a pause before each answer: slow_controller.py SECONDS --ros-args ..."""

import sys
import time

from quad_core.cascade import ATTITUDE
from quad_node.law_node import LawNode
from quad_node.main import run

PAUSE = float(sys.argv.pop(1))


def slow():
    """Return a node that computes as every controller, but late."""
    made = LawNode(ATTITUDE)
    compute = made.compute

    def late(*given):
        time.sleep(PAUSE)
        return compute(*given)

    made.compute = late
    return made


sys.exit(run(ATTITUDE, slow, "slow"))
