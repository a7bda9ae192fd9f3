"""Standby controllers in lockstep: who takes over, and what becomes of a controller that is started again in flight."""

import os
import signal
import time
from contextlib import ExitStack

import flying
import pytest
from takeovers import STANDBY, active_pid, asked, environment_of, killed_and_started_again, said_in
from test_same_bits import alone, assert_same

from quad_flight_log.analysis.replay import replay
from quad_flight_log.analysis.takeovers import exchanges, fliers
from quad_node.watch import FlightWatch

pytestmark = pytest.mark.flight

POSITION, ATTITUDE = "position_controller", "attitude_controller"
WARM_STEPS = 1000
PERIODS = {POSITION: 5, ATTITUDE: 1}  # steps


def test_both_controllers_die_and_the_flight_has_the_same_bits(tmp_path):
    out = tmp_path / "bag"
    process = flying.start("hover", "--duration", "2", "--seed", "31", *STANDBY, "--out", out)
    part = out / "bag_0.mcap.part"
    flying.wait_until(lambda: part.exists() and part.stat().st_size > 60_000, 90.0, "the recording began")
    for role in (ATTITUDE, POSITION):
        os.kill(active_pid(process.pid, role), signal.SIGKILL)
    done = flying.finish(process)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "attitude_controller was killed by SIGKILL; the flight does not depend on it" in done.stderr
    bag = flying.open_flight(out)
    assert_same(bag, alone("hover", 2.0, 31, "rigid_body", "tuned"))
    kinds = [row["kind"] for row in bag.array("flight/events")]
    assert kinds.count("taken_over") == 2
    assert sorted(row["role"] for row in bag.array("flight/takeover")) == [
        "shadow_attitude_controller",
        "shadow_position_controller",
    ]


def details(bag, role):
    """Return what ``role`` said on flight/nodes."""
    return [row["detail"] for row in bag.array("flight/nodes") if row["role"] == role]


@pytest.mark.parametrize(
    ("role", "words"),
    [
        (ATTITUDE, ["hover", "--duration", "60"]),
        # begun anew it would be DISARMED, and the motors off
        ("commander", ["--mission", "takeoff,hold:60,land"]),
    ],
)
def test_who_comes_back_without_a_standby_stays_silent(tmp_path, role, words):
    out = tmp_path / "bag"
    # patient, so that the plant still asks when the new process is there
    process = flying.start(*words, "--set", "simulator.repeat_limit=12", "--out", out)
    flying.wait_until_flying(process, out)
    time.sleep(2.0)
    with killed_and_started_again(active_pid(process.pid, role), tmp_path / "again.log") as again:
        done = flying.finish(process)
        assert again.wait(20.0) == 1
    assert f"the flight is under way without {role}; this process stays silent" in (tmp_path / "again.log").read_text()
    assert done.returncode == 1, done.stdout + done.stderr
    bag = flying.open_flight(out)
    assert f"{role} does not answer" in bag.metadata["reason"]
    assert [said for said in details(bag, role) if "under way without" in said]
    lost = int(bag.metadata["reason"].partition("answer step ")[2].partition(":")[0])
    given = {ATTITUDE: "wrench_setpoint", "commander": "flight/mode"}[role]
    assert int(bag.array(given)["stamp_ns"].max()) < lost * 2_000_000
    assert "motors stopped" not in done.stderr


def test_controllers_that_were_started_again_stand_by_and_fly_again(tmp_path):
    """One is asked to, the other takes over from its dead standby."""
    out = tmp_path / "bag"
    process = flying.start("hover", "--duration", "45", *STANDBY, "--out", out)
    pids = flying.wait_until_flying(process, out)
    logs = {role: tmp_path / f"{role}.log" for role in (POSITION, ATTITUDE)}
    domain = int(environment_of(pids["simulator"])["ROS_DOMAIN_ID"])
    with ExitStack() as stack:
        again = [
            stack.enter_context(killed_and_started_again(active_pid(process.pid, role), log))
            for role, log in logs.items()
        ]
        for log in logs.values():
            flying.wait_until(lambda log=log: said_in(log, r"stands_by: step (\d+)"), 30.0, "a controller stands by")
        watch = FlightWatch(said_in(logs[POSITION], r"run (\S+),"), domain)
        stack.callback(watch.close)
        memory = max(int(said_in(log, r"stands_by: step (\d+)")) for log in logs.values())
        early = asked(domain, ATTITUDE)
        assert not early[0] or watch.poll(0.1).step > memory + WARM_STEPS, early
        flying.wait_until(
            lambda: (state := watch.poll(0.1)) and state.step > memory + WARM_STEPS + 100, 60.0, "memories are warm"
        )
        late = early if early[0] else asked(domain, ATTITUDE)
        assert late[0], (early, late)
        os.kill(active_pid(process.pid, POSITION, shadow=True), signal.SIGKILL)
        done = flying.finish(process)
        assert done.returncode == 0, done.stdout + done.stderr
        assert [process.wait(20.0) for process in again] == [0, 0]
    bag = flying.open_flight(out)
    kinds = [row["kind"] for row in bag.array("flight/events")]
    assert {kind: kinds.count(kind) for kind in ("taken_over", "replaced", "second_publisher")} == {
        "taken_over": 4,
        "replaced": 1,  # the others were killed
        "second_publisher": 0,
    }
    assert len(exchanges(bag)) == 4
    for role in (POSITION, ATTITUDE):
        first, second, third = fliers(bag, role)
        assert (first.node, second.node, third.node) == (role, f"shadow_{role}", role)
        assert (first.memory_step, second.memory_step) == (0, 0)
        assert third.step >= third.memory_step + WARM_STEPS
        assert [said for said in details(bag, role) if f"{role} stands by" in said]
        # it may be there before its shadow has taken over, and hear the step before, that was answered
        assert third.memory_step >= second.step - PERIODS[role]
        found = replay(bag, role)
        assert found.equal, found.differences()
