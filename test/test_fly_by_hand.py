"""`scripts/fly_by_hand.sh`, the very file, through a stand-in `ros2` that execs the real executables."""

import os
import signal
import subprocess
import time

import pytest
from flying import ROOT, assert_landed, finish, in_domain, wait_until_flying

from quad_bringup.surroundings import reserved_domain
from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight

STAND_IN = """#!/usr/bin/env bash
[[ $1 == run ]] || { echo "ros2: only run, found $1" >&2; exit 2; }
for prefix in ${AMENT_PREFIX_PATH//:/ }; do
    [[ ! -x $prefix/lib/$2/$3 ]] || exec "$prefix/lib/$2/$3" "${@:4}"
done
echo "ros2: no $2 $3" >&2
exit 2
"""


REALTIME = ("flight.mode:=realtime", "trajectory:hover.duration:=60.0", "trajectory:hover.position.z:=0.8")


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


def test_bad_usage_ends_with_2(by_hand):
    done = finish(by_hand("hover", "bag", "-p", "vehicle.mass:=-1.0"))
    assert done.returncode == 2, done.stdout + done.stderr
    assert "vehicle.mass" in done.stderr


@pytest.mark.wall_clock
def test_ctrl_c_in_real_time_is_a_landing(by_hand, tmp_path):
    """The terminal asks all processes and the script asks the nodes: that is one request, not two."""
    words = [word for setting in REALTIME for word in ("-p", setting)]
    flight = by_hand("hover", tmp_path / "bag", *words, start_new_session=True)
    wait_until_flying(flight, tmp_path / "bag")
    time.sleep(2.0)
    os.killpg(flight.pid, signal.SIGINT)
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    bag = open_flight(tmp_path / "bag")
    assert not bag.truncated
    assert_landed(bag)
