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


def test_what_is_missing_is_named(tmp_path):
    file = tmp_path / "airframe.yaml"
    file.write_text("", "utf-8")
    for given, words in (
        ({"given": "mavros"}, "px4, mavlink, crazyflie"),
        ({"given": "mavlink"}, "docs/mavlink.md"),
        ({"given": f"px4={tmp_path / 'none.yaml'}"}, "found no file"),
        ({"given": f"px4={file}", "realtime": False}, "expected --realtime"),
        ({"given": f"px4={file}", "own": ["simulator=true"]}, "--own simulator"),
    ):
        with pytest.raises(ParameterError, match=words):
            asked(**given)
