"""Flights whose controller dies: the guard in the vehicle's owner lands the vehicle, the event names the dead node."""

import os
import signal
import subprocess
import time

import pytest
from flying import FLY, LOW, PATIENT, alive, assert_landed, finish, start, terminal, wait_until_flying

from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight


REALTIME = ("--realtime", *PATIENT)
SMALL = ("--set", "trajectory.case2.position_scale=0.3")
ATTITUDE, POSITION = "attitude_controller", "position_controller"
NO_WRENCH = "attitude_controller does not answer"
NO_SETPOINT = "position_controller does not answer: attitude_setpoint older than 0.3 s"
NO_REFERENCE = "trajectory does not answer: reference older than 2 s"
STOPPED = "simulator stopped by SIGINT; guard in descend"


def ended(words, out, victim, name):
    """Return how a flight ended in which ``victim`` got the signal ``name`` in the air, and its bag."""
    flight = start(*words, "--out", out)
    pids = wait_until_flying(flight, out)
    time.sleep(2.0)
    os.kill(pids.get(victim, flight.pid), getattr(signal, name))
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert not [pid for pid in pids.values() if alive(pid)]
    bag = open_flight(out)
    assert not bag.truncated
    return done, bag


@pytest.mark.parametrize(
    ("words", "victim", "name", "said", "reason"),
    [
        pytest.param(
            ("hover", *LOW), ATTITUDE, "SIGKILL", f"{ATTITUDE} was killed by SIGKILL", NO_WRENCH,
            id="lockstep", marks=pytest.mark.long,  # so does test_restarted_node
        ),
        # the guard's own 50 ms are measured: only a machine without other work can show them
        pytest.param(
            ("hover", *LOW, "--realtime"), ATTITUDE, "SIGKILL", f"{ATTITUDE} was killed by SIGKILL", NO_WRENCH,
            id="realtime", marks=pytest.mark.long,
        ),
        # the attitude controller alone would fly on, level
        pytest.param(
            ("hover", *LOW, "--realtime"), POSITION, "SIGKILL", f"{POSITION} was killed by SIGKILL", NO_SETPOINT,
            id="position", marks=pytest.mark.wall_clock,
        ),
        pytest.param(
            ("case2", *SMALL, *REALTIME), "trajectory", "SIGKILL", "case2: trajectory ", NO_REFERENCE,
            id="case2", marks=pytest.mark.wall_clock,
        ),
        pytest.param(
            ("case2", *REALTIME), "trajectory", "SIGSTOP", "case2: trajectory ", NO_REFERENCE,
            id="case2, stopped", marks=[pytest.mark.wall_clock, pytest.mark.long],
        ),
    ],
)  # fmt: skip
def test_a_flight_whose_node_dies_is_landed_and_the_node_named(tmp_path, words, victim, name, said, reason):
    done, bag = ended(words, tmp_path / "bag", victim, name)
    assert said in done.stderr
    assert bag.metadata["reason"].startswith(reason)
    assert "guard in descend" in bag.metadata["reason"]
    assert_landed(bag)
    if victim == POSITION:
        guard = bag.array("flight/guard")
        began = int(guard["step"][guard["mode"] == 1][0])
        assert (began - int(bag.array("attitude_setpoint")["step"].max())) * 0.002 < 0.5


@pytest.mark.wall_clock
def test_a_terminal_that_goes_is_a_landing(tmp_path):
    """It hangs up three times (kernel, shell, kernel) and takes no more words: nothing of that stops the motors."""
    out = tmp_path / "bag"
    words = [FLY, "hover", "--realtime", *LOW, "--duration", "60", "--out", out, *PATIENT]
    with terminal() as (master, options):
        flight = subprocess.Popen(list(map(str, words)), **options)
        wait_until_flying(flight, out)
        time.sleep(2.0)
        os.close(master)
    for _ in range(2):
        time.sleep(0.05)
        flight.send_signal(signal.SIGHUP)
    assert flight.wait(60) == 1
    bag = open_flight(out)
    assert not bag.truncated
    assert bag.metadata["reason"].startswith(STOPPED)
    assert_landed(bag)
