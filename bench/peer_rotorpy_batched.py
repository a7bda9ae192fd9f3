"""Many quadrotors in RotorPy's batched mode (PyTorch) at 500 Hz: SE3 control and vehicle step, RK4; prints JSON."""

import json
import sys
import time
from importlib.metadata import version

import numpy as np
import torch
from rotorpy.controllers.quadrotor_control import BatchedSE3Control
from rotorpy.trajectories.hover_traj import HoverTraj
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import BatchedMultirotor, BatchedMultirotorParams, Multirotor


def repeated(values: dict[str, object], worlds: int) -> dict[str, torch.Tensor]:
    """Return one state or reference as a batch of ``worlds``."""
    return {
        key: torch.from_numpy(np.repeat(np.asarray(value, dtype=float)[None], worlds, axis=0))
        for key, value in values.items()
    }


def main(steps: int, worlds: int) -> None:
    """Fly at least ``steps`` steps in all worlds together."""
    device = torch.device("cpu")
    params = BatchedMultirotorParams([quad_params] * worlds, worlds, device)
    state = repeated(Multirotor(quad_params).initial_state, worlds)
    vehicle = BatchedMultirotor(params, worlds, state, device, integrator="rk4")
    controller = BatchedSE3Control(params, worlds, device)
    setpoint = repeated(HoverTraj().update(0.0), worlds)
    calls = max(1, steps // worlds)
    with torch.inference_mode():
        for number in range(calls + 2):
            if number == 2:
                wall, cpu = time.perf_counter(), time.process_time()
            state = vehicle.step(state, controller.update(number * 0.002, state, setpoint), 0.002)
    took = {"steps": calls * worlds, "wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
    if not torch.isfinite(state["x"]).all():
        sys.exit("rotorpy: a vehicle was lost")
    print(json.dumps({**took, "version": version("rotorpy")}))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
