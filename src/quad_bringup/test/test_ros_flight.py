"""What one flight starts: a node of one's own says itself what counts. What it prints: no empty table."""

import pytest

from quad_bringup import results
from quad_bringup.ros_flight import started
from quad_flight_log.analysis.metrics import FlightMetrics

FILE = ["--ros-args", "--params-file", "flight.yaml"]


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["mine", "--fast"], ["mine", "--fast", *FILE]),
        (["mine", "--ros-args", "-p", "vehicle.mass:=0.8"], ["mine", *FILE, "--ros-args", "-p", "vehicle.mass:=0.8"]),
    ],
)
def test_a_parameter_of_the_command_comes_after_the_file(command, words):
    assert started(command, FILE) == words


def test_a_flight_of_which_nothing_was_measured_shows_no_empty_table():
    found = results.Report("ended", 12.0, 6.0, FlightMetrics(), {}, [], "metrics are those of mode MISSION alone")
    assert results.text("hover", found, "seed 1").splitlines() == [
        "hover: no metrics: metrics are those of mode MISSION alone",
        "seed 1; 12.00 s flown at 6.00 x real time; ended",
    ]
    measured = found._replace(metrics=FlightMetrics(position_rmse=0.01))
    assert "position_rmse" in results.text("hover", measured, "seed 1")
