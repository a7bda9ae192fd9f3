"""`scripts/fly_by_hand.sh`, the very file, through a stand-in `ros2` that execs the real executables."""

import os
import signal
import subprocess

import pytest
from flying import ROLES, ROOT, alive, finish, in_domain, wait_until_flying

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


@pytest.fixture
def by_hand(tmp_path):
    """Return a function that starts the script with a `ros2` on its PATH, in a domain that no other flight has."""
    tools = tmp_path / "bin"
    tools.mkdir()
    (tools / "ros2").write_text(STAND_IN, encoding="utf-8")
    (tools / "ros2").chmod(0o755)

    def begin(*arguments):
        environment = in_domain(domain)
        environment["PATH"] = f"{tools}:{environment['PATH']}"
        command = [str(ROOT / "scripts/fly_by_hand.sh"), *map(str, arguments)]
        pipe = subprocess.PIPE
        return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment, cwd=tmp_path)

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
