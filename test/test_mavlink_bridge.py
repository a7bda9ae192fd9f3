"""The bridge over MAVLink as a node: hover with the position law."""

import numpy as np
import pytest
from px4_flights import MavlinkFlight

from quad_flight_log.bag.reader import open_flight

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

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
