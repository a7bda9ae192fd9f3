"""Many worlds of one quadrotor in Crazyflow on the CPU, 500 Hz, state control at 100 Hz; prints JSON."""

import json
import sys
import time
from importlib.metadata import version

import jax
import numpy as np
from crazyflow.sim import Sim

WORLDS = 1024
CONTROL_STEPS = 5


def main(steps: int) -> None:
    """Fly at least ``steps`` steps in all worlds together."""
    sim = Sim(n_worlds=WORLDS, n_drones=1, control="state", freq=500, state_freq=100, attitude_freq=500, device="cpu")
    command = np.zeros((WORLDS, 1, 16), dtype=np.float32)
    command[..., 2] = 1.0
    sim.reset()
    calls = max(1, steps // (WORLDS * CONTROL_STEPS))
    for number in range(calls + 2):
        if number == 2:
            wall, cpu = time.perf_counter(), time.process_time()
        sim.state_control(command)
        sim.step(CONTROL_STEPS)
        jax.block_until_ready(sim.data)
    took = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
    print(json.dumps({"steps": calls * CONTROL_STEPS * WORLDS, **took, "version": version("crazyflow")}))


if __name__ == "__main__":
    main(int(sys.argv[1]))
