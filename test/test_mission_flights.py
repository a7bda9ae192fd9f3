"""Missions flown over ROS: take-off, curve, hold and landing, to the bit; requests, Ctrl-C and a dead trajectory."""

import os
import re
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from flying import alive, finish, flown, hash_of, in_domain, start, stranger, wait_until, wait_until_flying
from rclpy.executors import SingleThreadedExecutor

from quad_core.enumerations import Mode
from quad_flight_log.reader import open_flight
from quad_msgs.msg import FlightMode
from quad_node.topics import latched

pytestmark = pytest.mark.flight

COMMAND = Path(get_package_prefix("quad_commander"), "lib", "quad_commander", "command")
_AT_HEIGHT_BYTES = 1_500_000  # 0.4 MB a second; 1 m is reached after 3 s
HOLDS = ("--mission", "takeoff:1,hold:600,land")
LOW_HOVER = ("--mission", "takeoff:1,hover,land", "--set", "trajectory.hover.position.z=1.0", "--duration", "600")
LANDED = [Mode.LAND, Mode.DISARMED]
MISSION = ("--mission", "takeoff,goto:0.5 0 1.5 45deg,hover,hold:1,land", "--duration", "2")


def entered(flight):
    """Return the modes of a bag in order, each once per entry."""
    modes = flight.array("flight/mode")["mode"]
    return [Mode(int(mode)) for mode in modes[np.r_[True, modes[1:] != modes[:-1]]]]


def touchdown(flight):
    """Return height in m and speed in m/s of the vehicle when the motors stopped, and its largest speed below 2 cm."""
    truth, mode = flight.array("truth"), flight.array("flight/mode")
    off = mode["step"][np.flatnonzero(mode["mode"] > Mode.ARMING)[-1] + 1]
    landing = mode["step"][np.flatnonzero(mode["mode"] == Mode.LAND)[0]]
    at = np.searchsorted(truth["step"], off)
    low = truth[(truth["step"] > landing) & (truth["p_w"][:, 2] < 0.02)]
    return truth["p_w"][at, 2], np.linalg.norm(truth["v_w"][at]), np.abs(low["v_w"][:, 2]).max()


def test_a_mission_in_lockstep_repeats_to_the_bit(tmp_path):
    first = flown(*MISSION, "--out", tmp_path / "first")
    assert entered(first) == [Mode.ARMING, Mode.TAKEOFF, Mode.HOLD, Mode.MISSION, Mode.HOLD, Mode.LAND, Mode.DISARMED]
    reference = first.array("reference")
    arrived = np.isclose(reference["p_w"], [0.5, 0.0, 1.5]).all(axis=1) & np.isclose(reference["yaw"], np.radians(45.0))
    assert arrived.any()
    height, speed, fastest = touchdown(first)
    assert abs(height) < 0.01
    assert speed < 0.1
    assert fastest < 1.0
    second = flown(*MISSION, "--out", tmp_path / "second")
    assert hash_of(tmp_path / "first") == hash_of(tmp_path / "second")
    names = [name for name in first.array("flight/mode").dtype.names if name not in ("run", "log_ns")]
    for name in names:
        assert np.array_equal(first.array("flight/mode")[name], second.array("flight/mode")[name]), name
    events = first.array("flight/events")
    assert [
        text.partition(":")[0] for kind, text in zip(events["kind"], events["text"], strict=True) if kind == "mode"
    ] == [
        "DISARMED to ARMING",
        "ARMING to TAKEOFF",
        "TAKEOFF to HOLD",
        "HOLD to MISSION",
        "MISSION to HOLD",
        "HOLD to LAND",
        "LAND to DISARMED",
    ]


def wait_until_high(process, directory):
    """Return {role: pid} of the nodes once the bag is long enough for the take-off to be over."""
    return wait_until_flying(process, directory, _AT_HEIGHT_BYTES)


def domain_of(process):
    """Return the domain that `fly` says it flies in."""
    for line in process.stdout:
        found = re.search(r"ROS_DOMAIN_ID=(\d+)$", line)
        if found and "bag" in line:
            return int(found[1])
    raise AssertionError("fly did not say its domain")


def command(domain, *words):
    return subprocess.run(
        [COMMAND, *words], env=in_domain(domain), capture_output=True, text=True, timeout=60, check=False
    )


def test_hold_and_land_are_asked_for_in_flight(tmp_path):
    out = tmp_path / "bag"
    flight = start(*LOW_HOVER, "--out", out)
    domain = domain_of(flight)
    wait_until_high(flight, out)
    refused = command(domain, "arm")
    assert (refused.returncode, "refused: ARM is not possible in" in refused.stderr) == (1, True), refused
    sent = command(domain, "goto", "0.5", "-0.5", "1.5", "-90deg")
    assert (sent.returncode, "the mode is HOLD" in sent.stdout) == (0, True), sent
    held = command(domain, "hold")
    assert (held.returncode, "the mode is HOLD" in held.stdout) == (0, True), held
    with stranger(domain, "late") as node:  # as `ros2 topic echo --once` does
        executor, found = SingleThreadedExecutor(context=node.context), []
        executor.add_node(node)
        node.create_subscription(FlightMode, "flight/mode", found.append, latched(1000))
        wait_until(lambda: executor.spin_once(0.1) or found, 20.0, "a mode")
        executor.shutdown()
    assert found[0].name == "HOLD", "who comes late sees the mode that is flown now"
    landing = command(domain, "land")
    assert (landing.returncode, "the mode is LAND" in landing.stdout) == (0, True), landing
    done = finish(flight)
    assert done.returncode == 1
    assert "mission not finished: LAND at step" in done.stderr
    bag = open_flight(out)
    assert entered(bag)[-3:] == [Mode.HOLD, Mode.LAND, Mode.DISARMED]
    assert abs(touchdown(bag)[0]) < 0.01
    steps = [int(found) for found in re.findall(r"done at step (\d+)", sent.stdout + held.stdout + landing.stdout)]
    modes = bag.array("flight/mode")
    flown = [int(modes["mode"][np.searchsorted(modes["step"], step)]) for step in steps]
    assert flown == [Mode.HOLD, Mode.HOLD, Mode.LAND]
    events = bag.array("flight/events")
    asked = [
        text.split()[::2][:2]
        for kind, text in zip(events["kind"], events["text"], strict=True)
        if kind in ("request", "request_refused")
    ]
    assert [word for word, sender in asked if sender.startswith("service")] == ["GOTO", "HOLD", "LAND"]


def test_a_command_without_a_flight_says_so():
    done = command(88, "land", "--patience", "1")
    assert done.returncode == 2
    assert "command: land: land: found no commander without a namespace within 1 s, expected one" in done.stderr


@pytest.mark.parametrize(
    ("words", "victim", "name", "modes", "reason"),
    [
        (HOLDS, "fly", "SIGINT", LANDED, "landed: simulator was asked to end by SIGINT"),
        ((*HOLDS, "--plant", "mujoco"), "fly", "SIGTERM", LANDED, "landed: simulator was asked to end by SIGINT"),
        (LOW_HOVER, "trajectory", "SIGKILL", [Mode.MISSION, Mode.HOLD, *LANDED], "mission reference older than 2 s"),
        (HOLDS, "commander", "SIGKILL", [Mode.HOLD], "commander.*guard in descend"),
    ],
    ids=["SIGINT", "SIGTERM", "trajectory", "commander"],
)
def test_a_mission_that_is_disturbed_lands_and_the_cause_is_named(tmp_path, words, victim, name, modes, reason):
    """In lockstep; scripts/accept stops does the same in real time."""
    out = tmp_path / "bag"
    flight = start(*words, "--out", out)
    pids = wait_until_high(flight, out)
    os.kill(pids.get(victim, flight.pid), getattr(signal, name))
    done = finish(flight)
    assert done.returncode == 1, done.stdout + done.stderr
    assert (f"{victim} was killed by {name}" if victim in pids else f"interrupted by {name}") in done.stderr
    bag = open_flight(out)
    assert not bag.truncated
    assert entered(bag)[-len(modes) :] == modes
    assert re.search(reason, bag.metadata["reason"])
    assert abs(bag.array("truth")["p_w"][-1, 2]) < 0.01
    assert not [pid for pid in pids.values() if alive(pid)]


def test_a_flight_whose_starter_is_killed_lands_and_ends(tmp_path):
    out = tmp_path / "bag"
    flight = start(*HOLDS, "--out", out)
    pids = wait_until_high(flight, out)
    flight.kill()
    flight.communicate()
    wait_until(lambda: not [pid for pid in pids.values() if alive(pid)], 60.0, "all nodes have left")
    bag = open_flight(out)
    assert entered(bag)[-2:] == [Mode.LAND, Mode.DISARMED]
    assert bag.metadata["reason"] == "landed: the process that started the flight is gone"
