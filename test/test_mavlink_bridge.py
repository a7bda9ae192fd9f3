"""The bridge over MAVLink as a node: hover with the position law, refusals with their reason, what lacks."""

import os
import subprocess

import numpy as np
import pytest
from px4_flights import PERIODS, MavlinkFlight
from vehicle_packages import vehicle_packages

from quad_flight_log.bag.reader import open_flight

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

BRIDGE = MavlinkFlight.owner
ALONE = ["-p", "flight.roles:=simulator"]
THRUST = ["-p", "max_rotor_thrust:=8.549"]
NODES = {"trajectory": ["-p", "trajectory:=hover", "-p", "hover.duration:=1.0"], "position_controller": []}


def test_the_position_law_hovers_and_the_autopilot_lands(tmp_path):
    bag, roles = tmp_path / "bag", ["-p", "flight.roles:=" + ",".join(["simulator", *NODES, "recorder"])]
    with MavlinkFlight(tmp_path / "hover", {"drop": 0.01, "nan_every": 60}, *roles) as flight:
        for role, words in {**NODES, "recorder": []}.items():
            period = ["-p", "period_steps:=2"] if role != "recorder" else ["-p", f"directory:={bag}"]
            flight.node(role, *roles, *period, *words)
        ended = flight.end()
    assert ended.code == 0, ended.output
    events = ended.report["events"]
    landing = next(at for at, what in events if what == "command 21")
    poses = np.array(ended.report["poses"])
    hover = poses[(poses[:, 0] * 1e-6 > landing - 0.5) & (poses[:, 0] * 1e-6 < landing)]
    assert np.abs(hover[:, 1:] - [0.0, 0.0, -2.0]).max() < 0.2
    assert events[-1][1] == "disarmed"
    assert ended.report["refusals"] == []
    assert ended.report["idle_broken"] == 0
    assert "PX4 at" in ended.output
    assert len(open_flight(bag).array("state")) > 200


def test_what_the_autopilot_refuses_ends_the_flight_with_its_words(tmp_path):
    quick = [*ALONE, "-p", "arming.step_timeout:=2.0"]
    with MavlinkFlight(tmp_path / "refused", {"bad_preflight": True}, *quick) as flight:
        ended = flight.end()
    assert ended.code == 1
    cause = next(line for line in ended.output.splitlines() if "flight_failed" in line)
    for word in ("PX4 did not arm", "temporarily rejected", "pre-flight checks fail", "Compass Sensor 0 missing"):
        assert word in cause, ended.output
    assert not [what for _, what in ended.report["events"] if "armed" in what.split(", ")]


def test_what_cannot_fly_ends_with_one_line_and_2():
    whole = {**os.environ, "PYTHONPATH": os.pathsep.join([os.environ.get("PYTHONPATH", ""), str(vehicle_packages())])}
    for environment, words, named in (
        (os.environ, [*PERIODS, *THRUST], "pymavlink: not found"),
        (whole, PERIODS, "max_rotor_thrust: found 0.0"),
        (whole, [*PERIODS, *THRUST, "-p", "listen:=here"], "listen: found 'here', expected host:port"),
    ):
        done = subprocess.run(
            [BRIDGE, "--ros-args", *ALONE, *words],
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert done.returncode == 2, done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr
        assert named in done.stderr
