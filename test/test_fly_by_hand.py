"""`scripts/fly_by_hand.sh`, the very file, through a stand-in `ros2` that execs the real executables."""

import os
import signal
import subprocess
import time

import pytest
from flying import ROLES, ROOT, alive, assert_landed, finish, in_domain, terminal, wait_until, wait_until_flying

from quad_bringup.domains import reserved_domain
from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight

STAND_IN = """#!/usr/bin/env bash
[[ $1 == run ]] || { echo "ros2: only run, found $1" >&2; exit 2; }
for prefix in ${AMENT_PREFIX_PATH//:/ }; do
    [[ ! -x $prefix/lib/$2/$3 ]] || exec "$prefix/lib/$2/$3" "${@:4}"
done
echo "ros2: no $2 $3" >&2
exit 2
"""


REALTIME = (
    "-p",
    "flight.mode:=realtime",
    "-p",
    "trajectory:hover.duration:=60.0",
    "-p",
    "trajectory:hover.position.z:=0.8",
)


@pytest.fixture
def by_hand(tmp_path):
    """Return a function that starts the script with a `ros2` on its PATH, in a domain that no other flight has."""
    tools = tmp_path / "bin"
    tools.mkdir()
    (tools / "ros2").write_text(STAND_IN, encoding="utf-8")
    (tools / "ros2").chmod(0o755)

    def begin(*arguments, **options):
        environment = in_domain(domain)
        environment["PATH"] = f"{tools}:{environment['PATH']}"
        command = [str(ROOT / "scripts/fly_by_hand.sh"), *map(str, arguments)]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        return subprocess.Popen(command, env=environment, cwd=tmp_path, **{**pipes, **options})

    with reserved_domain(None) as domain:
        yield begin


def test_a_good_flight_ends_with_0_and_its_figures(by_hand, tmp_path):
    done = finish(by_hand("hover", tmp_path / "bag", "-p", "flight.seed:=9", "-p", "trajectory:hover.duration:=0.5"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "position_rmse" in done.stdout
    bag = open_flight(tmp_path / "bag")
    assert (bag.metadata["outcome"], bag.metadata["seed"]) == ("ended", "9")


def test_a_diverging_flight_ends_with_1_and_its_cause(by_hand, tmp_path):
    printed = ("position_controller:preset:=printed", "attitude_controller:preset:=printed")
    settings = (
        *printed,
        "trajectory:case1.start:=printed",
        "vehicle.thrust_to_weight:=20.0",
        "simulator:guard.enabled:=false",
    )
    choices = [word for setting in settings for word in ("-p", setting)]
    done = finish(by_hand("case1", tmp_path / "bag", *choices))
    assert done.returncode == 1, done.stdout + done.stderr
    assert "diverged" in done.stderr
    assert open_flight(tmp_path / "bag").metadata["outcome"] == "failed"


@pytest.mark.parametrize(
    ("arguments", "word"),
    [(["orbit", "bag"], "orbit.yaml"), (["hover", "bag", "-p", "vehicle.mass:=-1.0"], "vehicle.mass")],
)
def test_bad_usage_ends_with_2(by_hand, arguments, word):
    done = finish(by_hand(*arguments))
    assert done.returncode == 2, done.stdout + done.stderr
    assert word in done.stderr


@pytest.mark.parametrize("role", ["attitude_controller", "simulator", "recorder"])
def test_a_killed_node_ends_the_flight_with_1(by_hand, tmp_path, role):
    quick = ("-p", "trajectory:hover.duration:=60.0", "-p", "flight.silence_timeout:=3.0")
    flight = by_hand("hover", tmp_path / "bag", *quick)
    pids = wait_until_flying(flight, tmp_path / "bag")
    assert set(pids) == set(ROLES)
    os.kill(pids[role], signal.SIGKILL)
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert role in done.stderr, done.stderr
    assert not [pid for pid in pids.values() if alive(pid)]
    assert open_flight(tmp_path / "bag").truncated == (role == "recorder")


def test_sigterm_ends_all_nodes(by_hand, tmp_path):
    flight = by_hand("hover", tmp_path / "bag", "-p", "trajectory:hover.duration:=60.0")
    pids = wait_until_flying(flight, tmp_path / "bag")
    flight.terminate()
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert not [pid for pid in pids.values() if alive(pid)]
    assert not open_flight(tmp_path / "bag").truncated


@pytest.mark.wall_clock
def test_ctrl_c_in_real_time_is_a_landing(by_hand, tmp_path):
    """The terminal asks all processes and the script asks the nodes: that is one request, not two."""
    flight = by_hand("hover", tmp_path / "bag", *REALTIME, start_new_session=True)
    wait_until_flying(flight, tmp_path / "bag")
    time.sleep(2.0)
    os.killpg(flight.pid, signal.SIGINT)
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    bag = open_flight(tmp_path / "bag")
    assert not bag.truncated
    assert_landed(bag)


@pytest.mark.wall_clock
def test_a_terminal_that_goes_is_a_landing(by_hand, tmp_path):
    """The nodes go on with what they say, which nobody takes any more."""
    with terminal() as (master, options):
        flight = by_hand("hover", tmp_path / "bag", *REALTIME, **options)
        pids = wait_until_flying(flight, tmp_path / "bag")
        time.sleep(2.0)
        os.close(master)
    for pid in pids.values():
        os.kill(pid, signal.SIGHUP)
    assert flight.wait(60) == 1
    bag = open_flight(tmp_path / "bag")
    assert not bag.truncated
    assert_landed(bag)


@pytest.mark.wall_clock
def test_a_recorder_that_is_asked_to_end_waits_for_no_vehicle_that_is_gone(by_hand, tmp_path):
    flight = by_hand("hover", tmp_path / "bag", *REALTIME, "-p", "flight.silence_timeout:=6.0")
    pids = wait_until_flying(flight, tmp_path / "bag")
    os.kill(pids["simulator"], signal.SIGKILL)
    os.kill(pids["recorder"], signal.SIGTERM)
    wait_until(lambda: not alive(pids["recorder"]), 4.0, "the recorder has left")
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert not open_flight(tmp_path / "bag").truncated
