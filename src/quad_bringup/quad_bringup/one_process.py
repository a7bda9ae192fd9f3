"""All nodes of a flight in one process and one executor: the same messages over the same topics."""

import sys
from collections.abc import Callable
from functools import partial

from quad_core.cascade import POSITION, STAGES
from quad_node.law_node import LawNode
from quad_node.main import Owner, run_all

NAME = "one_process"


def makers() -> list[Callable[[], Owner]]:
    """Return the classes of the nodes, the simulator first."""
    from quad_dynamics.node import Simulator
    from quad_flight_log.node import Recorder
    from quad_position_ctrl.node import make as make_position_controller
    from quad_trajectory.node import Trajectory

    return [
        Simulator,
        Trajectory,
        make_position_controller,
        *(partial(LawNode, stage.role) for stage in STAGES if stage.role != POSITION),
        Recorder,
    ]


def main() -> None:
    """Run the nodes in this process."""
    if {"--help", "-h"} & set(sys.argv):
        sys.stdout.write(f"{__doc__}\n\nusage: ros2 run quad_bringup {NAME} --ros-args --params-file FILE\n")
        sys.exit(0)
    sys.exit(run_all(NAME, makers(), sys.argv))


if __name__ == "__main__":
    main()
