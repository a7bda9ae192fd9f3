"""Missions with an autopilot over the real wire: whole, and with what pilots, batteries and estimators do."""

import time

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from px4_flights import Flight, environment

# an autopilot has a processor of its own
pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

COMMANDER = f"{get_package_prefix('quad_commander')}/lib/quad_commander/commander"
ROLES = ("simulator", "trajectory", "position_controller", "attitude_controller", "commander")


@pytest.fixture(scope="module")
def given():
    return environment()


def start(flight, role, *words):
    """Start a node of the flight."""
    return flight.replaced(role, [COMMANDER], *words) if role == "commander" else flight.node(role, *words)


def flown(folder, given, options, mission, *bridge):
    """Return how a mission ended whose nodes all run."""
    roles = ["-p", "flight.roles:=" + ",".join(ROLES), "-p", "flight.run_id:=m1"]
    with Flight(folder, given, options, *roles, *bridge) as flight:
        for role in ROLES[1:]:
            own = {"trajectory": ["-p", "trajectory:=hover"], "commander": ["-p", f"mission:={mission}"]}
            start(flight, role, *roles, "-p", "period_steps:=2", *own.get(role, []))
        return flight.end()


def happened(ended):
    return [what for _, what in ended.report["events"]]


def lowest_from(ended, moment):
    """Return the true height in m at which ``moment`` happened."""
    at = next(at for at, what in ended.report["events"] if what == moment)
    poses = np.array(ended.report["poses"])
    return -poses[np.argmin(np.abs(poses[:, 0] * 1e-6 - at)), 3]


def test_a_mission_takes_off_holds_and_lands_by_the_autopilot(given, tmp_path):
    ended = flown(tmp_path / "whole", given, {}, "takeoff:2,hold:2,land")
    assert ended.code == 0, ended.output
    events = happened(ended)
    assert events.index("nav_state 14, arming_state 2") < events.index("nav_state 18, arming_state 2")
    assert events[-1] == "disarmed"
    height = -np.array(ended.report["poses"])[:, 3]
    assert 1.8 < height.max() < 2.3
    assert ended.report["idle_broken"] == 0


def test_a_landing_of_ours_is_disarmed_on_the_ground(given, tmp_path):
    ended = flown(tmp_path / "ours", given, {}, "takeoff:1.5,hold:1,land", "-p", "arming.landing:=ours")
    assert ended.code == 0, ended.output
    assert "command 21" not in happened(ended)
    assert lowest_from(ended, "disarmed") < 0.05


def test_the_autopilots_own_take_off_is_flown_on_by_us(given, tmp_path):
    ended = flown(tmp_path / "climb", given, {}, "takeoff:3,hold:2,land", "-p", "arming.takeoff:=autopilot")
    assert ended.code == 0, ended.output
    events = happened(ended)
    assert events.index("command 22") < events.index("took off") < events.index("nav_state 18, arming_state 2")
    assert 2.7 < -np.array(ended.report["poses"])[:, 3].min() < 3.4


def test_a_pilot_who_takes_over_in_a_mission_has_the_vehicle(given, tmp_path):
    ended = flown(tmp_path / "pilot", given, {"pilot_after": 6.0}, "takeoff:2,hold:60,land")
    assert ended.code == 1
    assert "took the vehicle in flight: mode POSCTL" in ended.output
    taken = next(at for at, what in ended.report["events"] if what == "pilot")
    assert not [what for at, what in ended.report["events"] if at > taken and "command" in what]
    assert max(ended.report["heartbeats"]) < taken + 0.1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"battery_after": 6.0}, "battery below"),
        ({"reset_after": 6.0, "reset_by": 1.0}, "the estimate jumped by 1.00 m"),
    ],
)
def test_a_low_battery_lands_and_a_reset_holds(given, tmp_path, options, words):
    ended = flown(tmp_path / "fault", given, options, "takeoff:2,hold:5,land")
    said = (tmp_path / "fault/commander.log").read_text("utf-8") + ended.output
    assert words in said, said
    assert happened(ended)[-1] == "disarmed"
    assert lowest_from(ended, "disarmed") < 0.05


def test_a_commander_that_is_killed_ends_in_a_landing(given, tmp_path):
    roles = ["-p", "flight.roles:=" + ",".join(ROLES), "-p", "flight.run_id:=m1"]
    with Flight(tmp_path / "killed", given, {}, *roles) as flight:
        nodes = {}
        for role in ROLES[1:]:
            own = {"trajectory": ["-p", "trajectory:=hover"], "commander": ["-p", "mission:=takeoff:2,hold:60,land"]}
            nodes[role] = start(flight, role, *roles, "-p", "period_steps:=2", *own.get(role, []))
        flight.wait_for("COMPONENT_ARM_DISARM")
        time.sleep(6.0)
        nodes["commander"].kill()
        ended = flight.end()
    assert ended.code == 1
    assert "commander: no flight/mode any more" in ended.output
    assert happened(ended)[-1] == "disarmed"
