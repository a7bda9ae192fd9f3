"""Each node as the process that `ros2 run` would start: help, refusals, signals."""

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix

pytestmark = pytest.mark.flight

NODES = {
    "simulator": "quad_dynamics",
    "trajectory": "quad_trajectory",
    "position_controller": "quad_position_ctrl",
    "attitude_controller": "quad_attitude_ctrl",
    "recorder": "quad_flight_log",
}


def command(role: str, *args: str) -> list[str]:
    package = NODES[role]
    return [str(Path(get_package_prefix(package), "lib", package, role)), *args]


def call(role: str, *args: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(role, *args), capture_output=True, text=True, timeout=30, check=False)


def test_help_says_how_it_is_started_and_where_the_parameters_are():
    done = call("simulator", "--help")
    assert done.returncode == 0
    assert "usage: ros2 run quad_dynamics simulator" in done.stdout
    assert "docs/reference/parameters/simulator.md" in done.stdout


@pytest.mark.parametrize(("role", "argument", "words"), [
    ("simulator", "vehicle.mass:=-1.0", ["vehicle.mass", "-1.0", "0.001"]),
    ("trajectory", "hover.duration:='long'", ["hover.duration", "long"]),
    ("position_controller", "law:=lqr", ["lqr", "aibs"]),
    ("recorder", "finish_timeout:='soon'", ["finish_timeout", "soon", "number"]),
    ("recorder", "directory:=/", ["directory", "/"]),
])  # fmt: skip
def test_a_bad_parameter_is_refused_by_name(role, argument, words):
    done = call(role, "--ros-args", "-p", argument)
    assert done.returncode == 2, done.stderr
    assert all(word in done.stderr for word in words), done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr


EXECUTABLES = [
    ("quad_dynamics", "simulator"),
    ("quad_node", "odometry_relay"),
    ("quad_dynamics", "check_plant"),
    ("quad_report", "log"),
    ("quad_bringup", "fly"),
    ("quad_bringup", "one_process"),
]


@pytest.mark.parametrize(("package", "name", "words"), [
    *((package, name, ["--nonsense"]) for package, name in EXECUTABLES),
    ("quad_dynamics", "simulator", ["-p", "flight.seed:=7"]),
    ("quad_dynamics", "simulator", ["--ros-args", "--nonsense"]),
])  # fmt: skip
def test_unknown_words_are_refused(package, name, words):
    path = Path(get_package_prefix(package), "lib", package, name)
    done = subprocess.run([path, *words], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert any(word in done.stderr for word in words) or "COMMAND" in done.stderr


@pytest.mark.parametrize(("text", "words"), [
    ("/**:\n  ros__parameters: {vehicle: {mass: -1.0}}\n", ["vehicle.mass", "-1.0", "0.001"]),
    ("/**:\n  ros__parameters: {hover: {duration: long}}\n", ["hover.duration", "long"]),
    ("trajectry:\n  ros__parameters: {a: 1}\n", ["trajectry"]),
    ("trajectory:\n  ros__parameters: {period_steps: 5, period_steps: 6}\n", ["twice"]),
])  # fmt: skip
def test_a_bad_parameter_file_is_refused_by_name(tmp_path, text, words):
    good, bad = tmp_path / "good.yaml", tmp_path / "bad.yaml"
    good.write_text("/**:\n  ros__parameters: {vehicle: {mass: 0.6}}\n", encoding="utf-8")
    bad.write_text(text, encoding="utf-8")
    done = call("trajectory", "--ros-args", "--params-file", str(good), "--params-file", str(bad))
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith(f"trajectory: {bad}: "), done.stderr
    assert all(word in done.stderr for word in words), done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr


def wait_for_handler(node, number, patience=60.0):
    """Wait until the process itself catches the signal: how long its start takes is up to the machine's load."""
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        assert node.poll() is None, node.stderr.read()
        caught = re.search(r"SigCgt:\t(\w+)", Path("/proc", str(node.pid), "status").read_text(encoding="utf-8"))
        if int(caught[1], 16) >> (number - 1) & 1:
            return
        time.sleep(0.05)
    raise AssertionError(f"{node.args}: no handler of signal {number} after {patience} s")


@pytest.mark.wall_clock
@pytest.mark.parametrize(
    ("role", "name"),
    [("simulator", "SIGTERM"), ("attitude_controller", "SIGINT"), ("recorder", "SIGTERM"), ("recorder", "SIGHUP")],
)
def test_a_signal_ends_a_waiting_node_within_two_seconds(role, name, tmp_path):
    extra = ("-p", f"directory:={tmp_path}/bag") if role == "recorder" else ()
    environment = {**os.environ, "ROS_DOMAIN_ID": "191"}
    heeding = ["env", "--default-signal=HUP"]  # also where nohup has started the tests
    words = [*heeding, *command(role, "--ros-args", *extra)]
    node = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, env=environment)
    wait_for_handler(node, signal.SIGTERM)
    asked = time.monotonic()
    node.send_signal(getattr(signal, name))
    _, errors = node.communicate(timeout=10)
    assert time.monotonic() - asked < 2.0
    assert node.returncode == 1, errors
    assert "Traceback" not in errors, errors
