"""`--vehicle-owner` names its bridge, or says in one line what is missing."""

import argparse

import pytest

from quad_bringup import vehicle_owner
from quad_core.parameters import ParameterError


def asked(given, realtime=True, own=()):
    return vehicle_owner.commands(argparse.Namespace(vehicle_owner=given, realtime=realtime, own=list(own)))


@pytest.mark.parametrize("name", ["px4", "mavlink", "crazyflie"])
def test_the_bridge_takes_the_simulators_place_with_its_file(tmp_path, name):
    file = tmp_path / "airframe.yaml"
    file.write_text("", "utf-8")
    command = asked(f"{name}={file}")["simulator"]
    assert command[0].endswith(f"quad_{name}/{name}_bridge")
    assert command[1:] == ["--ros-args", "--params-file", str(file)]
    assert asked("") == asked(None) == {}


SPACED = [
    "flight.plant_period=4000000",
    "trajectory.period_steps=2",
    "position_controller.period_steps=2",
    "attitude_controller.period_steps=2",
]


def test_periods_fit_the_spacing_of_each_autopilots_states():
    for name, period in (("px4", 4_000_000), ("mavlink", 4_000_000), ("crazyflie", 5_000_000)):
        found = vehicle_owner.settings(argparse.Namespace(vehicle_owner=f"{name}=file", mission=None))
        assert found == [f"flight.plant_period={period}", *SPACED[1:]]
    assert vehicle_owner.settings(argparse.Namespace(vehicle_owner=None)) == []


def test_joined_is_the_plant_under_px4_and_controllers_do_not_age_while_it_waits(tmp_path):
    file = tmp_path / "joined.yaml"
    file.write_text("", "utf-8")
    assert asked(f"joined={file}")["simulator"][0].endswith("quad_mavlink/joined_plant")
    given = argparse.Namespace(vehicle_owner=f"joined={file}", mission=None)
    assert vehicle_owner.settings(given) == [
        *SPACED,
        "position_controller.input_timeout=60",
        "attitude_controller.input_timeout=60",
    ]
    assert vehicle_owner.settings(argparse.Namespace(vehicle_owner=None)) == []


def test_what_is_missing_is_named(tmp_path):
    file = tmp_path / "airframe.yaml"
    file.write_text("", "utf-8")
    for given, words in (
        ({"given": "mavros"}, "crazyflie, joined, mavlink, px4"),
        ({"given": "joined"}, "docs/how_to/px4.md"),
        ({"given": "mavlink"}, "docs/how_to/mavlink.md"),
        ({"given": f"px4={tmp_path / 'none.yaml'}"}, "found no file"),
        ({"given": f"px4={file}", "realtime": False}, "expected --realtime"),
        ({"given": f"px4={file}", "own": ["simulator=true"]}, "--own simulator"),
    ):
        with pytest.raises(ParameterError, match=words):
            asked(**given)


def test_a_mission_gives_the_commander_the_pace_of_states_and_joined_its_patience():
    plain = vehicle_owner.settings(argparse.Namespace(vehicle_owner="px4=file", mission="takeoff,land"))
    assert plain == [*SPACED, "commander.period_steps=2"]
    joined = vehicle_owner.settings(argparse.Namespace(vehicle_owner="joined=file", mission="takeoff,land"))
    assert {"commander.period_steps=2", "commander.modes.state_lost=60", "commander.modes.setpoint_lost=60"} < set(
        joined
    )
