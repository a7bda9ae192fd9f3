"""The bridge to a Crazyflie over the real cflib and UDP: a refusal; test_vehicle_missions flies it."""

import pytest
from px4_flights import CrazyflieFlight

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]


def test_a_crazyflie_that_does_not_arm_ends_the_flight_on_the_ground(tmp_path):
    alone = ["-p", "flight.roles:=simulator", "-p", "arming.step_timeout:=3.0"]
    with CrazyflieFlight(tmp_path / "refused", {"cannot_arm": True}, *alone) as flight:
        ended = flight.end()
    assert ended.code == 1
    cause = next(line for line in ended.output.splitlines() if "flight_failed" in line)
    assert "Crazyflie did not arm" in cause, ended.output
    assert "pre-flight checks fail" in cause
    assert ended.report["manual"] == []
