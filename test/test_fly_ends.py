"""Flights that are ended from outside: killed nodes, Ctrl-C. A named cause, exit code 1, no orphans, a readable bag."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from flying import (
    FLY,
    LONGEST,
    PATIENT,
    ROLES,
    alive,
    bag_file,
    finish,
    last_reception,
    start,
    wait_until,
    wait_until_flying,
)

from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight

# test_recorder_kill holds a writer to 0.3 s; a loaded machine may not let the recorder run for so long
LARGEST_LOSS = 1.5


@pytest.mark.parametrize("role", ROLES)
def test_a_killed_node_ends_the_flight_by_name(tmp_path, role):
    out = tmp_path / "bag"
    flight = start("hover", "--duration", "60", "--out", out)
    pids = wait_until_flying(flight, out)
    assert set(pids) == set(ROLES)
    killed = time.time()
    os.kill(pids[role], signal.SIGKILL)
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"fly: hover: {role} was killed by SIGKILL" in done.stderr, done.stderr
    assert not [pid for pid in pids.values() if alive(pid)]
    assert last_reception(bag_file(out)) > killed - LARGEST_LOSS
    bag = open_flight(out)
    assert bag.truncated == (role == "recorder")
    steps = bag.array("truth")["step"]
    assert np.array_equal(steps, np.arange(len(steps)))
    assert len(steps) > 100


@pytest.mark.parametrize(
    ("words", "name", "moment"),
    [
        ((), "SIGINT", 0.0),
        pytest.param((), "SIGTERM", 0.7, marks=pytest.mark.long),
        (("--one-process",), "SIGINT", 1.2),
        pytest.param(("--one-process", "--realtime", *PATIENT), "SIGINT", 0.4, marks=pytest.mark.wall_clock),
    ],
    ids=["five processes", "SIGTERM", "one process", "one process, real time"],
)
def test_an_interrupted_flight_leaves_no_orphans_and_a_closed_bag_that_names_the_signal(tmp_path, words, name, moment):
    out = tmp_path / "bag"
    flight = start("hover", "--duration", "60", *words, "--out", out)
    pids = wait_until_flying(flight, out, 20_000)
    time.sleep(moment)
    flight.send_signal(getattr(signal, name))
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"interrupted by {name}" in done.stderr
    assert "Traceback" not in done.stderr
    wait_until(lambda: not [pid for pid in pids.values() if alive(pid)], 2.0, "all nodes have left")
    bag = open_flight(out)
    assert not bag.truncated
    assert bag.metadata["outcome"] == "failed"
    assert "SIGINT" in bag.metadata["reason"]  # what fly sends its nodes, whichever signal it got


def test_with_nohup_a_flight_outlives_its_terminal_and_its_nodes_a_killed_fly(tmp_path):
    """They fly on to the planned end, as without fly, and nothing is left elsewhere."""
    out, elsewhere = tmp_path / "bag", tmp_path / "tmp"
    elsewhere.mkdir()
    command = ["nohup", str(FLY), "hover", "--duration", "1", "--out", str(out)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    flight = subprocess.Popen(command, env={**os.environ, "TMPDIR": str(elsewhere)}, **pipes)
    pids = wait_until_flying(flight, out)
    for pid in (flight.pid, *pids.values()):
        os.kill(pid, signal.SIGHUP)
    time.sleep(0.3)
    assert [pid for pid in (flight.pid, *pids.values()) if not alive(pid)] == []
    flight.kill()
    flight.communicate()
    wait_until(lambda: not [pid for pid in pids.values() if alive(pid)], LONGEST, "all nodes have left")
    assert open_flight(out).metadata["outcome"] == "ended"
    assert (out / "logs" / "simulator.log").read_text().endswith("ended: flown as planned\n")
    assert list(elsewhere.iterdir()) == []


def test_a_boot_script_that_closed_the_streams_costs_the_words_alone(tmp_path):
    out = tmp_path / "bag"
    words = f"exec {FLY} hover --duration 1 --start printed --limits position_rmse=9 --out {out} <&- >&- 2>&-"
    assert subprocess.run(["bash", "-c", words], timeout=120, check=False).returncode == 0
    bag = open_flight(out)
    assert (bag.truncated, bag.metadata["outcome"]) == (False, "ended")
    done = subprocess.run(["bash", "-c", f"exec {sys.executable} -m quad_report.cli check {out} >&-"], check=False)
    assert done.returncode == 0
