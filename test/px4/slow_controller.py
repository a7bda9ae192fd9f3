"""The attitude controller with a pause before each answer: slow_controller.py SECONDS --ros-args ..."""

import sys
import time

from quad_core.cascade import ATTITUDE
from quad_node.main import run
from quad_node.responder import LawNode

PAUSE = float(sys.argv.pop(1))


class Slow(LawNode):
    """Computes as every controller, but late."""

    def __init__(self):
        super().__init__(ATTITUDE)

    def answer(self, sample, arrivals):
        """Give the law's answer after a pause."""
        time.sleep(PAUSE)
        yield from super().answer(sample, arrivals)


sys.exit(run(ATTITUDE, Slow, "slow"))
