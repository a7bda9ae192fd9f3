"""What a node says last reaches who reads slowly: it leaves only when they have it."""

import os
import signal
import time

import pytest
from flying import alive, domain_of, finish, node_pids, run_id_of, start, wait_until

from quad_flight_log.reader import open_flight
from quad_node.watch import FlightWatch, is_over

pytestmark = pytest.mark.flight


def test_a_recorder_does_not_leave_before_the_simulator_has_read_that_the_bag_is_closed(tmp_path):
    """Who had left first was dropped with what it said, in 5 of 293 flights on a busy machine: 20 s of waiting."""
    out = tmp_path / "bag"
    flight = start("hover", "--duration", "1", "--limits", "position_rmse=9", "--out", out)
    wait_until(lambda: list(out.glob("*.part")), 60.0, "a recorder")
    pids = node_pids(flight.pid)
    watch = FlightWatch(run_id_of(flight.pid), domain_of(flight.pid))
    wait_until(lambda: (seen := watch.poll(0.01)) is not None and is_over(seen), 60.0, "the end of the flight")
    watch.close()
    os.kill(pids["simulator"], signal.SIGSTOP)
    wait_until(lambda: (out / "metadata.yaml").exists(), 60.0, "a closed bag")
    time.sleep(1.5)
    waits = alive(pids["recorder"])
    os.kill(pids["simulator"], signal.SIGCONT)
    done = finish(flight)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "did not finish in time" not in done.stdout + done.stderr
    assert waits
    assert open_flight(out).metadata["outcome"] == "ended"
