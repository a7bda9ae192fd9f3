"""The bridge to a Crazyflie over the real cflib and UDP: a hover and a refusal."""

import numpy as np
import pytest
from px4_flights import CrazyflieFlight

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

ALONE = ["-p", "flight.roles:=simulator", "-p", "arming.step_timeout:=3.0"]
NODES = {"trajectory": ["-p", "trajectory:=hover", "-p", "hover.duration:=1.0"], "position_controller": []}


def cause(ended):
    return next(line for line in ended.output.splitlines() if "flight_failed" in line)


def test_the_position_law_hovers_by_angles_and_the_crazyflie_lands(tmp_path):
    roles = ["-p", "flight.roles:=" + ",".join(["simulator", *NODES])]
    with CrazyflieFlight(tmp_path / "hover", {}, *roles) as flight:
        for role, words in NODES.items():
            flight.node(role, *roles, "-p", "period_steps:=2", *words)
        ended = flight.end()
    assert ended.code == 0, ended.output
    assert ended.report["refusals"] == []
    events = ended.report["events"]
    landing = next(at for at, what in events if what.startswith("land"))
    poses = np.array(ended.report["poses"])
    hover = poses[(poses[:, 0] * 1e-3 > landing - 0.5) & (poses[:, 0] * 1e-3 < landing)]
    assert np.abs(hover[:, 1:] - [0.0, 0.0, 2.0]).max() < 0.2
    assert [what for _, what in events][-2:] == ["stop", "disarmed"]
    assert max(row[0] for row in ended.report["manual"]) < landing + 0.1
    assert poses[-1, 3] < 0.05


def test_a_crazyflie_that_does_not_arm_ends_the_flight_on_the_ground(tmp_path):
    with CrazyflieFlight(tmp_path / "refused", {"cannot_arm": True}, *ALONE) as flight:
        ended = flight.end()
    assert ended.code == 1
    assert "Crazyflie did not arm" in cause(ended), ended.output
    assert "pre-flight checks fail" in cause(ended)
    assert ended.report["manual"] == []
