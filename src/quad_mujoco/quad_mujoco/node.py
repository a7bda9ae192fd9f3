"""`ros2 run quad_mujoco simulator`: the simulator node with the plant ``mujoco``."""

import sys

from quad_core.cascade import SIMULATOR
from quad_dynamics.node import Simulator
from quad_node.main import run

SUMMARY = "Quadrotor simulated by MuJoCo: takes wrench_setpoint, publishes state and truth; plant is mujoco."


def main() -> None:
    """Run the simulator node with the plant ``mujoco`` whatever the parameter files say."""
    sys.exit(run(SIMULATOR, Simulator, SUMMARY, [*sys.argv, "--ros-args", "-p", "plant:=mujoco"]))
