"""What one flight starts: a node of one's own says itself what counts."""

from types import SimpleNamespace

import pytest

from quad_bringup import ros_flight
from quad_bringup.ros_flight import BAD_SETUP, FAILED, started
from quad_bringup.supervisor import Outcome

FILE = ["--ros-args", "--params-file", "flight.yaml"]


@pytest.mark.parametrize(("command", "words"), [
    (["mine", "--fast"], ["mine", "--fast", *FILE]),
    (["mine", "--ros-args", "-p", "vehicle.mass:=0.8"], ["mine", *FILE, "--ros-args", "-p", "vehicle.mass:=0.8"]),
])  # fmt: skip
def test_a_parameter_of_the_command_comes_after_the_file(command, words):
    assert started(command, FILE) == words


@pytest.mark.parametrize(
    ("table", "role", "expected", "named"),
    [
        ("", "trajectory", BAD_SETUP, "trajectory: no parameter height"),
        ("rmse 1.0\n", "trajectory", FAILED, "hover: trajectory ended with exit code 2"),
        ("rmse 1.0\n", "shadow_1", BAD_SETUP, "trajectory: no parameter height"),
    ],
)
def test_exit_code_2_of_a_node_is_bad_set_up_only_before_the_flight(table, role, expected, named, monkeypatch, capsys):
    monkeypatch.setattr(ros_flight, "SHADOWS", ("shadow_1",))
    monkeypatch.setattr(ros_flight, "shown", lambda flight: (table, [], [], False))
    processes = SimpleNamespace(codes={role: 2}, last_lines=lambda role, count: ["trajectory: no parameter height"])
    flight = SimpleNamespace(name="hover", own={}, directory="flights/hover")
    cause = f"{role} ended with exit code 2"
    assert ros_flight._judge(flight, processes, Outcome(cause), None) == expected
    assert named in capsys.readouterr().err
