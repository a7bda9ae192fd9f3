"""Standby controllers in real time: one is killed, started again, stands by and flies again."""

import os
import signal

import flying
import numpy as np
import pytest
from takeovers import STANDBY, active_pid, environment_of, killed_and_started_again, said_in

from quad_flight_log.analysis.takeovers import fliers
from quad_node.watch import FlightWatch

pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

ROLE = "attitude_controller"
WARM_STEPS = 1000
LOST = 50_000_000  # ns without a wrench after which the guard takes over


def test_a_controller_that_was_started_again_takes_over_from_its_standby(tmp_path):
    out, log = tmp_path / "bag", tmp_path / "again.log"
    words = ("hover", "--realtime", "--duration", "8", "--limits", "position_max=5", *STANDBY)
    process = flying.start(*words, "--out", out)
    pids = flying.wait_until_flying(process, out)
    domain = int(environment_of(pids["simulator"])["ROS_DOMAIN_ID"])
    with killed_and_started_again(active_pid(process.pid, ROLE), log) as again:
        flying.wait_until(lambda: said_in(log, r"stands_by: step (\d+)"), 10.0, "a controller stands by")
        memory = int(said_in(log, r"stands_by: step (\d+)"))
        watch = FlightWatch(said_in(log, r"run (\S+),"), domain)
        warm = memory + WARM_STEPS + 250
        flying.wait_until(lambda: (state := watch.poll(0.1)) and state.step > warm, 10.0, "its memory is warm")
        died = watch.poll(0.1).step
        watch.close()
        os.kill(active_pid(process.pid, ROLE, shadow=True), signal.SIGKILL)
        done = flying.finish(process)
        assert done.returncode == 0, done.stdout + done.stderr
        assert again.wait(20.0) == 0
    bag = flying.open_flight(out)
    first, second, third = fliers(bag, ROLE)
    assert (first.node, second.node, third.node) == (ROLE, f"shadow_{ROLE}", ROLE)
    assert third.step >= died
    assert memory <= third.memory_step <= third.step - WARM_STEPS
    assert np.diff(np.unique(bag.array("wrench_setpoint")["stamp_ns"])).max() < LOST
    # the vehicle had a wrench of a controller at every moment: the guard never took over
    assert set(bag.array("flight/guard")["mode"]) == {0}
    truth = bag.array("truth")
    assert np.ptp(truth["p_w"][truth["stamp_ns"] > died * 2_000_000, 2]) < 0.05
