"""Nodes that are killed in flight and started again: with a standby one flies again, without one it stays silent."""

import os
import re
import signal
import subprocess
import time
from contextlib import contextmanager

import flying
import numpy as np
import pytest
from flying import STANDBY, environment_of, words_of
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

from quad_flight_log.analysis.takeovers import fliers
from quad_node.watch import FlightWatch

pytestmark = pytest.mark.flight

ATTITUDE, POSITION = "attitude_controller", "position_controller"
WARM_STEPS = 1000
LOST = 50_000_000  # ns without a wrench after which the guard takes over


@contextmanager
def killed_and_started_again(pid, log):
    """Kill a node and start it again with the same words and environment; what it prints goes to ``log``."""
    words, environment = words_of(pid), environment_of(pid)
    os.kill(pid, signal.SIGKILL)
    with log.open("wb") as output:
        process = subprocess.Popen(words, env=environment, stdout=output, stderr=output, start_new_session=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def said_in(log, pattern):
    """Return the first group of ``pattern`` in what a node printed, None if it is not there."""
    found = re.search(pattern, log.read_text())
    return found and found[1]


def takes_over(domain, name):
    """Ask the node ``name`` to take over; returns whether it does."""
    with flying.stranger(domain, "operator") as node:
        client = node.create_client(Trigger, f"{name}/take_over")
        assert client.wait_for_service(20.0)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        answer = client.call_async(Trigger.Request())
        executor.spin_until_future_complete(answer, 10.0)
        return answer.result().success


@pytest.mark.wall_clock
def test_a_controller_that_was_started_again_takes_over_from_its_standby(tmp_path):
    """Meanwhile the standby of the other stage takes over on request."""
    out, log = tmp_path / "bag", tmp_path / "again.log"
    words = ("hover", "--realtime", "--duration", "12", "--limits", "position_max=5", *STANDBY)
    process = flying.start(*words, "--out", out)
    pids = flying.wait_until_flying(process, out)
    domain = flying.domain_of(process.pid)
    with killed_and_started_again(pids[ATTITUDE], log) as again:
        assert takes_over(domain, f"shadow_{POSITION}")
        flying.wait_until(lambda: said_in(log, r"stands_by: step (\d+)"), 10.0, "a controller stands by")
        memory = int(said_in(log, r"stands_by: step (\d+)"))
        watch = FlightWatch(said_in(log, r"run (\S+),"), domain)
        warm = memory + WARM_STEPS + 250
        flying.wait_until(lambda: (state := watch.poll(0.1)) and state.step > warm, 10.0, "its memory is warm")
        died = watch.poll(0.1).step
        watch.close()
        os.kill(pids[f"shadow_{ATTITUDE}"], signal.SIGKILL)
        done = flying.finish(process)
        assert done.returncode == 0, done.stdout + done.stderr
        assert again.wait(20.0) == 0
    bag = flying.open_flight(out)
    assert list(fliers(bag, POSITION).values()) == [POSITION, f"shadow_{POSITION}"]
    assert list(fliers(bag, ATTITUDE).values()) == [ATTITUDE, f"shadow_{ATTITUDE}", ATTITUDE]
    last = max(fliers(bag, ATTITUDE))
    said = bag.array("flight/takeover")
    assert last >= died
    assert memory <= said["memory_step"][said["step"] == last][0] <= last - WARM_STEPS
    assert np.diff(np.unique(bag.array("wrench_setpoint")["stamp_ns"])).max() < LOST
    # the vehicle had a wrench of a controller at every moment: the guard never took over
    assert set(bag.array("flight/guard")["mode"]) == {0}
    truth = bag.array("truth")
    assert np.ptp(truth["p_w"][truth["stamp_ns"] > died * 2_000_000, 2]) < 0.05


@pytest.mark.parametrize(
    ("role", "gives", "words"),
    [
        (ATTITUDE, "wrench_setpoint", ["hover", *flying.LOW, "--duration", "60"]),
        # begun anew it would be DISARMED, and the motors off
        ("commander", "flight/mode", ["--mission", "takeoff,hold:60,land"]),
    ],
)
def test_a_node_that_was_started_again_stays_silent(tmp_path, role, gives, words):
    out, log = tmp_path / "bag", tmp_path / "again.log"
    # patient, so that the plant still waits when the new process is there
    process = flying.start(*words, "--set", "simulator.answer_timeout=6.5", "--out", out)
    pids = flying.wait_until_flying(process, out)
    time.sleep(2.0)
    with killed_and_started_again(pids[role], log) as again:
        done = flying.finish(process)
        assert again.wait(20.0) == 1
    assert f"the flight is under way without {role}; this process stays silent" in log.read_text()
    assert done.returncode == 1, done.stdout + done.stderr
    bag = flying.open_flight(out)
    assert f"{role} does not answer" in bag.metadata["reason"]
    details = [row["detail"] for row in bag.array("flight/nodes") if row["role"] == role]
    assert [said for said in details if "under way without" in said]
    lost = int(bag.metadata["reason"].partition("answer step ")[2].partition(":")[0])
    assert int(bag.array(gives)["stamp_ns"].max()) < lost * 2_000_000
    assert "motors stopped" not in done.stderr
    assert f"{role} was killed by SIGKILL" in done.stderr
    assert "guard in descend" in bag.metadata["reason"]
    flying.assert_landed(bag)
