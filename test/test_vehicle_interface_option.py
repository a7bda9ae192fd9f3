"""`--vehicle-interface` names its bridge, or says in one line what is missing. It needs the packages of all bridges."""

import argparse

import pytest

from quad_bringup import vehicle_interface
from quad_core.parameters import ParameterError


def asked(given, realtime=True, own=(), mission="takeoff,land"):
    options = argparse.Namespace(vehicle_interface=given, realtime=realtime, own=list(own), mission=mission, step=None)
    return vehicle_interface.commands(options)


@pytest.mark.parametrize(
    ("name", "program"),
    [(name, f"quad_{name}/{name}_bridge") for name in ("px4", "mavlink", "crazyflie")]
    + [("joined", "quad_mavlink/joined_plant")],
)
def test_the_bridge_takes_the_simulators_place_with_its_file(tmp_path, name, program):
    file = tmp_path / "airframe.yaml"
    file.write_text("", "utf-8")
    command = asked(f"{name}={file}")["simulator"]
    assert command[0].endswith(program)
    assert command[1:] == ["--ros-args", "--params-file", str(file)]
    assert asked("") == asked(None) == {}


SPACED = [
    "flight.plant_period=4000000",
    "trajectory.period_steps=2",
    "position_controller.period_steps=2",
    "attitude_controller.period_steps=2",
    "commander.period_steps=2",
]


PATIENT = ["position_controller.input_timeout=60", "attitude_controller.input_timeout=60"]
AGES = [f"commander.modes.{age}=60" for age in ("reference_late", "reference_lost", "setpoint_lost", "state_lost")]


@pytest.mark.parametrize(("given", "found"), [
    (None, []),
    ("px4=file", SPACED),
    ("mavlink=file", SPACED),
    ("crazyflie=file", ["flight.plant_period=5000000", *SPACED[1:]]),
    ("joined=file", [*SPACED, *PATIENT, *AGES]),
])  # fmt: skip
def test_periods_fit_the_spacing_of_states_and_nothing_ages_while_a_joined_plant_waits(given, found):
    assert vehicle_interface.settings(argparse.Namespace(vehicle_interface=given)) == found


def test_what_is_missing_is_named(tmp_path):
    file = tmp_path / "airframe.yaml"
    file.write_text("", "utf-8")
    for given, words in (
        ({"given": "mavros"}, "crazyflie, joined, mavlink, px4"),
        ({"given": "joined"}, "docs/how_to/px4.md"),
        ({"given": "mavlink"}, "docs/how_to/mavlink.md"),
        ({"given": f"px4={tmp_path / 'none.yaml'}"}, "found no file"),
        ({"given": f"px4={file}", "realtime": False}, "expected --realtime"),
        ({"given": f"px4={file}", "mission": None}, "found no mission, expected one: --mission takeoff:2,case2,h"),
        ({"given": f"px4={file}", "own": ["simulator=true"]}, "--own simulator"),
    ):
        with pytest.raises(ParameterError, match=words):
            asked(**given)
