"""Many worlds of one quadrotor in Crazyflow on the CPU, 500 Hz, state control at 100 Hz; prints JSON.

INTEGRATOR is euler (its default) or rk4; the precision is that of JAX: float32, or float64 with JAX_ENABLE_X64=1 in
the environment. usage: peer_crazyflow.py STEPS WORLDS INTEGRATOR
"""

import json
import sys
import time
from importlib.metadata import version

import jax
import numpy as np
from crazyflow.sim import Sim

CONTROL_STEPS = 5


def main(steps: int, worlds: int, integrator: str) -> None:
    """Fly at least ``steps`` steps in all worlds together."""
    sim = Sim(worlds, control="state", integrator=integrator, freq=500, state_freq=100, attitude_freq=500, device="cpu")
    command = np.zeros((worlds, 1, 16), dtype=sim.data.states.pos.dtype)
    command[..., 2] = command[..., 12] = 1.0  # height, and the unit quaternion of the heading
    sim.reset()
    calls = max(1, steps // (worlds * CONTROL_STEPS))
    for number in range(calls + 2):
        if number == 2:
            wall, cpu = time.perf_counter(), time.process_time()
        sim.state_control(command)
        sim.step(CONTROL_STEPS)
        jax.block_until_ready(sim.data)
    took = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
    if not np.isfinite(np.asarray(sim.data.states.pos)).all():
        sys.exit("crazyflow: a vehicle was lost")
    print(
        json.dumps(
            {
                "steps": calls * CONTROL_STEPS * worlds,
                **took,
                "version": version("crazyflow"),
                "type": str(sim.data.states.pos.dtype),
            }
        )
    )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
