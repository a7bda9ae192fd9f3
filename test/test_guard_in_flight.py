"""Flights whose controller dies: the guard in the vehicle's owner lands the vehicle, the event names the dead node."""

import os
import signal
import subprocess
import time

import numpy as np
import pytest
from flying import FLY, LOW, PATIENT, alive, assert_landed, finish, start, terminal, wait_until_flying

from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight


# in real time the guard's own 50 ms are measured: only a machine without other work can show them
@pytest.mark.parametrize("clock", ["lockstep", pytest.param("realtime", marks=pytest.mark.long)])
def test_a_vehicle_whose_controller_was_killed_is_landed(tmp_path, clock):
    out = tmp_path / "bag"
    words = ["--realtime"] if clock == "realtime" else []
    flight = start("hover", *LOW, "--duration", "60", "--out", out, *words)
    pids = wait_until_flying(flight, out)
    time.sleep(2.0)
    os.kill(pids["attitude_controller"], signal.SIGKILL)
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "attitude_controller was killed by SIGKILL" in done.stderr
    assert not [pid for pid in pids.values() if alive(pid)]
    bag = open_flight(out)
    assert not bag.truncated
    assert "attitude_controller does not answer" in bag.metadata["reason"]
    assert "guard in descend" in bag.metadata["reason"]
    assert_landed(bag)


@pytest.mark.wall_clock
def test_an_interrupt_in_real_time_is_a_landing(tmp_path):
    out = tmp_path / "bag"
    flight = start("hover", "--realtime", *LOW, "--duration", "60", "--out", out, *PATIENT)
    wait_until_flying(flight, out)
    time.sleep(2.0)
    flight.send_signal(signal.SIGINT)
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "interrupted by SIGINT" in done.stderr
    bag = open_flight(out)
    assert not bag.truncated
    assert bag.metadata["reason"].startswith("simulator stopped by SIGINT; guard in descend")
    assert_landed(bag)


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
    assert bag.metadata["reason"].startswith("simulator stopped by SIGINT; guard in descend")
    assert_landed(bag)


@pytest.mark.wall_clock
@pytest.mark.parametrize("name", ["SIGKILL", pytest.param("SIGSTOP", marks=pytest.mark.long)])
def test_case_2_without_a_commander_lands_when_its_trajectory_is_silent(tmp_path, name):
    """It flew on to the last reference; stopped, nothing on the terminal named the trajectory."""
    out = tmp_path / "bag"
    flight = start("case2", "--realtime", *PATIENT, "--out", out)
    pids = wait_until_flying(flight, out)
    time.sleep(5.0)
    os.kill(pids["trajectory"], getattr(signal, name))
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "case2: trajectory " in done.stderr
    bag = open_flight(out)
    assert bag.metadata["reason"].startswith("trajectory does not answer: reference older than 2 s")
    truth = bag.array("truth")[-1]
    assert float(truth["p_w"][2]) < 0.3
    assert float(np.linalg.norm(truth["v_w"])) < 1.5


@pytest.mark.wall_clock
def test_a_silent_position_controller_without_a_commander_is_a_landing_at_once(tmp_path):
    """Its attitude controller flies on, level: 11 to 18 m of drift, and "simulator stopped by SIGINT" in the bag."""
    out = tmp_path / "bag"
    flight = start("hover", "--realtime", *LOW, "--duration", "60", "--out", out)
    pids = wait_until_flying(flight, out)
    time.sleep(2.0)
    os.kill(pids["position_controller"], signal.SIGKILL)
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "position_controller was killed by SIGKILL" in done.stderr
    bag = open_flight(out)
    assert bag.metadata["reason"].startswith("position_controller does not answer: attitude_setpoint older than 0.3 s")
    assert_landed(bag)
    guard = bag.array("flight/guard")
    began = int(guard["step"][guard["mode"] == 1][0])
    last = int(bag.array("attitude_setpoint")["step"].max())
    assert (began - last) * 0.002 < 0.5
