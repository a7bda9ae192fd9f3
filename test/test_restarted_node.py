"""Nodes that are killed in flight and started again stay silent."""

import os
import re
import signal
import subprocess
import time
from contextlib import contextmanager

import flying
import pytest
from flying import environment_of, words_of

pytestmark = pytest.mark.flight


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


@pytest.mark.parametrize(("role", "gives", "words"), [
    ("attitude_controller", "wrench_setpoint", ["hover", *flying.LOW, "--duration", "60"]),
    # begun anew it would be DISARMED, and the motors off
    ("commander", "flight/mode", ["--mission", "takeoff,hold:60,land"]),
])  # fmt: skip
def test_a_node_that_was_started_again_stays_silent(tmp_path, role, gives, words):
    out, log = tmp_path / "bag", tmp_path / "again.log"
    # patient, so that the plant still waits when the new process is there
    process = flying.start(*words, "--set", "simulator.answer_timeout=6.5", "--out", out)
    pids = flying.wait_until_flying(process, out)
    time.sleep(2.0)
    with killed_and_started_again(pids[role], log) as again:
        done = flying.finish(process)
        assert again.wait(2.0) == 1
    assert f"the flight is under way without {role}; this process stays silent" in log.read_text()
    assert done.returncode == 1, done.stdout + done.stderr
    bag = flying.open_flight(out)
    assert f"{role} does not answer" in bag.metadata["reason"]
    details = [row["detail"] for row in bag.array("flight/nodes") if row["role"] == role]
    assert [said for said in details if "under way without" in said]
    lost = int(re.search(r"answer step (\d+)", bag.metadata["reason"])[1])
    assert int(bag.array(gives)["stamp_ns"].max()) < lost * 2_000_000
    assert "motors stopped" not in done.stderr
    assert f"{role} was killed by SIGKILL" in done.stderr
    assert "guard in descend" in bag.metadata["reason"]
    flying.assert_landed(bag)
