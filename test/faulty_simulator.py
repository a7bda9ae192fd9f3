"""The simulator with three faults before its guard: those of `guard_faults`, from the file that QUAD_FAULTS names."""

import json
import os
import sys
from pathlib import Path

from guard_faults import Fault, asked, is_true, seen_state, spoiled

from quad_core.cascade import SIMULATOR
from quad_dynamics.node import Simulator
from quad_node.main import run


class FaultySimulator(Simulator):
    """Hands the guard what arrives under the faults; plant, topics and clock are the simulator's."""

    def __init__(self):
        super().__init__()
        self.faults = [Fault(*fault) for fault in json.loads(Path(os.environ["QUAD_FAULTS"]).read_text("utf-8"))]
        self.frozen = self.model.state

    def guarded(self, command, sample, step=None):
        """Return the wrench for the rotors over the current step."""
        k = self.current_step
        seen = seen_state(sample.state, self.frozen, *self.faults, k)
        self.frozen = seen.state
        arrived = command.arrived and is_true(seen, sample.state, k)
        self.guard_request = asked(*self.faults, k)
        return super().guarded(spoiled(command._replace(arrived=arrived), *self.faults, k), seen, step)


if __name__ == "__main__":
    sys.exit(run(SIMULATOR, FaultySimulator, "The simulator with faults before its guard."))
