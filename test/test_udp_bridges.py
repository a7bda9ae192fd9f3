"""The bridges over MAVLink and to a Crazyflie as nodes: one flies by attitude, the other is refused."""

import pytest
from px4_flights import cause, flown, happened

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]


def test_the_position_law_flies_over_mavlink_whatever_the_link_loses(tmp_path):
    ended = flown(tmp_path / "flight", "mavlink", {"drop": 0.01, "nan_every": 60}, "takeoff:1,hold:1,land")
    assert ended.code == 0, ended.output
    assert "PX4 at" in ended.output
    assert 0.8 < max(-pose[3] for pose in ended.report["poses"]) < 1.2
    assert happened(ended)[-1] == "disarmed"
    assert ended.report["refusals"] == []
    assert ended.report["idle_broken"] == 0


def test_a_crazyflie_that_does_not_arm_ends_the_flight_on_the_ground(tmp_path):
    quick = ("-p", "arming.step_timeout:=3.0")
    ended = flown(tmp_path / "refused", "crazyflie", {"cannot_arm": True}, "takeoff:1,land", *quick)
    assert ended.code == 1
    assert "Crazyflie did not arm" in cause(ended), ended.output
    assert "pre-flight checks fail" in cause(ended)
    assert ended.report["manual"] == []
