"""What a node says on its terminal, and who can join it."""

import re
import signal
import subprocess
import time
from contextlib import contextmanager

import pytest
from flying import AT_ONCE, executable, fly, in_domain, wait_until
from sockets import GROUP, LOOPBACK, udp_addresses

from quad_bringup.surroundings import reserved_domain
from quad_node.middleware import OPEN, RANGE, TRANSPORTS

pytestmark = pytest.mark.flight

PREFIX = re.compile(r"^\[(INFO|WARN|ERROR)\] \[[0-9.]+\] \[(?P<node>[\w.]+)\]: (?P<text>.*)$", re.MULTILINE)


@contextmanager
def alone(role, folder, **changes):
    """Run one node by hand, as a shell without scripts/env.sh would, its output in a file."""
    out = folder / "said.txt"
    with reserved_domain(None) as domain, out.open("w") as stream:
        environment = {**in_domain(domain), **changes}
        for name in (TRANSPORTS, RANGE):
            if name not in changes:
                environment.pop(name, None)
        words = [executable(role), "--ros-args", *(["-p", f"directory:={folder}/bag"] if role == "recorder" else [])]
        process = subprocess.Popen(words, env=environment, stdout=stream, stderr=stream, cwd=folder)
        try:
            yield process, lambda: PREFIX.findall(out.read_text())
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)


def texts(lines):
    return [text for _, _, text in lines]


WAITS = {
    "simulator": ["wrench_setpoint of attitude_controller", "flight/nodes READY of recorder"],
    "trajectory": ["state of simulator", "a reader of /reference (position_controller, recorder)"],
    "attitude_controller": ["attitude_setpoint of position_controller", "actuation of simulator"],
    "recorder": ["state of simulator", "flight/nodes of trajectory"],
}


PROFILES = """<?xml version="1.0"?>
<profiles xmlns="http://www.eprosima.com"><participant profile_name="lab" is_default_profile="true">
<rtps><name>lab</name></rtps></participant></profiles>
"""


@pytest.mark.parametrize("role", WAITS)
def test_a_node_alone_says_what_it_is_and_what_it_waits_for_and_listens_on_this_machine_alone(role, tmp_path):
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").write_text(PROFILES)  # Fast DDS loads it unless it is told not to
    with alone(role, tmp_path) as (process, said):
        wait_until(lambda: any("waiting for" in text for text in texts(said())), 30.0, f"{role} says what it waits for")
        assert {where for where, _ in udp_addresses(process.pid)} == {LOOPBACK, GROUP}
        time.sleep(3.0)
        started = [text for text in texts(said()) if text.startswith("starting: ")]
        waiting = [text for text in texts(said()) if text.startswith("waiting for ")]
    assert len(started) == 1
    assert started[0].startswith(f"starting: {role}, run not named, lockstep; seen only on this machine: ")
    assert len(waiting) == 1
    for part in WAITS[role]:
        assert part in waiting[0]
    assert not any("truth" in text or "disturbance" in text for text in waiting if role == "recorder")


def test_a_node_in_an_open_shell_says_so(tmp_path):
    with alone("trajectory", tmp_path, **{RANGE: "SUBNET"}) as (process, said):
        wait_until(lambda: texts(said()), 30.0, "a line")
        assert OPEN in texts(said())[0]
        assert "ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET" in texts(said())[0]
        wait_until(lambda: "0.0.0.0" in dict(udp_addresses(process.pid)), 10.0, "sockets for all, as asked")


def test_every_node_of_a_flight_says_its_lines_once_and_fly_does_not_repeat_them(tmp_path):
    done = fly("hover", *AT_ONCE, "--duration", "0.5", "--out", tmp_path / "a")
    assert done.returncode == 0, done.stdout + done.stderr
    for role in WAITS:
        lines = texts(PREFIX.findall((tmp_path / "a/logs" / f"{role}.log").read_text()))
        assert not [text for text in lines[lines.index("flying") :] if text.startswith("waiting")]
        said = [text.split(":")[0].split(" ")[0] for text in lines if not text.startswith("waiting")]
        assert [word for word in said if word in ("starting", "flying", "ended")] == ["starting", "flying", "ended"]
    printed = done.stdout + done.stderr
    assert not PREFIX.search(printed)
    assert "ended: " not in printed
