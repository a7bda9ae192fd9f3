"""A recorder that is stopped for a second in real time: it gets every message afterwards."""

import os
import signal
import time

import numpy as np
import pytest
from flying import PATIENT, finish, last_word, start, wait_until_flying

from quad_flight_log.bag.reader import open_flight

pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

PERIOD = 2_000_000  # ns
PLANT = ("state", "truth", "disturbance", "actuation")


def test_a_second_without_the_recorder_costs_no_message(tmp_path):
    out = tmp_path / "bag"
    flight = start("hover", "--realtime", "--duration", "4", "--limits", "position_max=5", *PATIENT, "--out", out)
    recorder = wait_until_flying(flight, out)["recorder"]
    time.sleep(0.5)
    os.kill(recorder, signal.SIGSTOP)
    time.sleep(1.0)
    os.kill(recorder, signal.SIGCONT)
    done = finish(flight)
    assert done.returncode == 0, done.stdout + done.stderr
    bag = open_flight(out)
    steps = {topic: np.unique(bag.array(topic)["stamp_ns"]) for topic in PLANT}
    missing = {topic: len(range(0, stamps[-1] + 1, PERIOD)) - len(stamps) for topic, stamps in steps.items()}
    assert max(missing.values()) <= last_word(bag, "simulator", "overruns"), missing
    assert [name for name in bag.metadata if name.startswith("missing.")] == []
    assert int(bag.metadata["steps"]) == steps["truth"][-1] // PERIOD
