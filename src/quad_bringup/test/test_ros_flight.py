"""What one flight starts: a node of one's own says itself what counts. What it prints: no empty table."""

from types import SimpleNamespace

import pytest

from quad_bringup import ros_flight
from quad_bringup.ros_flight import Planned, started
from quad_core.resolution import resolve
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


class Bag(SimpleNamespace):
    """What a flight without anything to measure left: its phase alone."""

    def has(self, topic):
        return True

    def array(self, topic):
        return [{"stamp_ns": 12_000_000_000, "wall_time": 2.0, "state": self.state}]


@pytest.mark.parametrize(
    ("metrics", "first", "state", "phase"),
    [
        (FlightMetrics(), "hover: no metrics: metrics are those of mode MISSION alone", 2, "ended"),
        (FlightMetrics(position_rmse=0.01), "metric", 7, "unknown"),
    ],
)
def test_a_flight_of_which_nothing_was_measured_shows_no_empty_table(
    monkeypatch, tmp_path, metrics, first, state, phase
):
    found = {
        "open_flight": Bag(state=state),
        "measured": metrics,
        "judgement": SimpleNamespace(problems=()),
        "ends_early": False,
    }
    found["truth_note"] = "metrics are those of mode MISSION alone"
    for name, value in found.items():
        monkeypatch.setattr(ros_flight, name, lambda *_, value=value, **__: value)
    nodes = {"simulator": resolve("simulator", {})}
    lines = ros_flight.shown(Planned("hover", "paper", "tuned", tmp_path, "", "", nodes, {})).text.splitlines()
    assert lines[0].startswith(first)
    assert lines[-1] == f"seed 1; 12.00 s flown at 6.00 x real time; {phase}"
