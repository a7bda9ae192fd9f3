"""What one flight starts: a node of one's own says itself what counts."""

import pytest

from quad_bringup.ros_flight import started

FILE = ["--ros-args", "--params-file", "flight.yaml"]


@pytest.mark.parametrize(("command", "words"), [
    (["mine", "--fast"], ["mine", "--fast", *FILE]),
    (["mine", "--ros-args", "-p", "vehicle.mass:=0.8"], ["mine", *FILE, "--ros-args", "-p", "vehicle.mass:=0.8"]),
])  # fmt: skip
def test_a_parameter_of_the_command_comes_after_the_file(command, words):
    assert started(command, FILE) == words
