"""Nodes of one's own on rclpy and quad_msgs alone take the place of ours, in both clocks, and are recorded."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from flying import ROOT, flown, fly

from quad_flight_log.reader import open_flight
from quad_report.cli import main

pytestmark = pytest.mark.flight

OWN = {role: ROOT / f"examples/own_nodes/{name}.py" for role, name in (("simulator", "vehicle"), ("trajectory",) * 2)}
FAR = ["--limits", "position_rmse=9"]  # a start by a step is far from its reference


def own(role):
    return ["--own", f"{role}={sys.executable} {OWN[role]}"]


def log(*words):
    return main([str(word) for word in words])


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Return the bag of a flight in lockstep with a trajectory of one's own and a vehicle that sends only its part."""
    folder = tmp_path_factory.mktemp("own") / "bag"
    done = fly("hover", *own("simulator"), *own("trajectory"), "--out", folder, *FAR)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "no truth in the bag" in done.stdout
    assert "vehicle paper, plant named below, " in done.stdout
    assert f"hover: simulator: {sys.executable} {OWN['simulator']} (" in done.stdout
    return folder


def test_a_vehicle_that_sends_only_what_it_must_flies_and_every_step_is_recorded(bag):
    flight = open_flight(bag)
    assert not [name for name in ("truth", "disturbance", "odom", "/clock", "clock") if flight.has(name)]
    assert flight.metadata["outcome"] == "ended"
    climbs(flight)
    states = flight.array("state")
    assert states["step"].tolist() == list(range(1500))
    assert flight.array("actuation")["step"].tolist() == list(range(1500))
    assert abs(states["p_w"][-1] - [0.0, 0.0, 0.5]).max() < 0.05
    poses = flight.array("pose")  # of the state, from 0.1 s on
    rows = states[np.searchsorted(states["stamp_ns"], poses["stamp_ns"])]
    assert abs(int(poses["stamp_ns"][0]) - 100_000_000) <= 10_000_000
    np.testing.assert_array_equal(rows["p_w"][:, 2], poses["pose"]["position"]["z"])
    shown = flight.array("/tf")["transforms"][-1][0]  # what RViz and Foxglove show
    assert (shown["header"]["frame_id"], shown["child_frame_id"]) == ("map", "base_link")


def test_every_verb_of_log_reads_a_bag_without_truth_and_says_so(bag, tmp_path, capsys):
    two = ["report", bag, "--names=a,b", "--out", tmp_path]
    for words in (["metrics"], ["check", "--limits", "position_rmse=9"], two):
        assert log(words[0], bag, *words[1:]) == 0
        assert "no truth in the bag" in capsys.readouterr().out
    assert log("metrics", bag, "--json") == 0
    assert "no truth" in json.loads(capsys.readouterr().out)[0]["note"]
    assert log("report", bag, "--out", tmp_path) == 0
    assert "no truth in the bag" in (tmp_path / "bag.html").read_text("utf-8")
    capsys.readouterr()
    assert log("replay", bag) == 0
    assert log("export", bag, "--out", tmp_path / "tables") == 0
    assert (tmp_path / "tables/state.csv").is_file()
    assert not (tmp_path / "tables/truth.csv").exists()


@pytest.mark.wall_clock
def test_both_fly_together_in_real_time(tmp_path):
    # How well they fly by the clock depends on what else this machine does; that they do does not.
    flight = flown("hover", "--realtime", *own("trajectory"), *own("simulator"), "--out", tmp_path / "bag", *FAR)
    climbs(flight)
    assert flight.metadata["outcome"] == "ended"
    assert flight.array("actuation")["step"].tolist() == list(range(1500))
    assert flight.array("state")["step"][-1] >= 1400


def climbs(flight):
    points = flight.array("reference")
    # half a cosine of 0.5 m in 2 s: highest speed 0.25 pi / 2 m/s
    assert points["p_w"][-1].tolist() == pytest.approx([0.0, 0.0, 0.5])
    assert points["v_w"][:, 2].max() == pytest.approx(np.pi / 8.0, rel=1e-3)


def test_a_command_that_leaves_before_the_flight_is_named_and_costs_little(tmp_path):
    began = time.monotonic()
    done = fly("hover", "--own", "trajectory=/bin/echo no node", "--out", tmp_path / "bag")
    assert time.monotonic() - began < 45.0  # 60 s is what a start may take
    assert done.returncode == 1
    lines = done.stderr.splitlines()
    at = lines.index("fly: hover: trajectory ended with exit code 0 before the flight began")
    assert any(line.startswith("fly: trajectory: no node --ros-args") for line in lines[at:])
    assert "position_rmse" not in done.stdout + done.stderr


def test_the_examples_are_as_short_as_the_pages_say():
    assert len(Path(OWN["trajectory"]).read_text("utf-8").splitlines()) < 90
    assert len(Path(OWN["simulator"]).read_text("utf-8").splitlines()) < 190


def test_they_need_no_more_of_us_than_messages_and_their_hash():
    for path in OWN.values():
        words = subprocess.run(["grep", "-hE", "^(from|import) quad", path], capture_output=True, text=True, check=True)
        assert {line.split()[1] for line in words.stdout.splitlines()} == {"quad_msgs.msg", "quad_node.handshake"}
