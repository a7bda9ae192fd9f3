"""One quadrotor in RotorPy at 500 Hz: trajectory, SE3 control and vehicle step, no sensors and no logs; prints JSON."""

import json
import sys
import time
from importlib.metadata import version

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.trajectories.hover_traj import HoverTraj
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor


def main(steps: int) -> None:
    """Fly ``steps`` steps."""
    vehicle, controller, path = Multirotor(quad_params), SE3Control(quad_params), HoverTraj()
    state = vehicle.initial_state
    wall, cpu = time.perf_counter(), time.process_time()
    for k in range(steps):
        state = vehicle.step(state, controller.update(k * 0.002, state, path.update(k * 0.002)), 0.002)
    took = {"steps": steps, "wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
    if not np.isfinite(state["x"]).all():
        sys.exit("rotorpy: the vehicle was lost")
    print(json.dumps({**took, "version": version("rotorpy")}))


if __name__ == "__main__":
    main(int(sys.argv[1]))
