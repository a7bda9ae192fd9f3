"""The launch file against stand-ins for launch and launch_ros, which are no wheels: which nodes, told what."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from quad_core.parameters import ParameterError

FILE = Path(__file__).parents[1] / "launch" / "flight.launch.py"


def stand_in(name, **content):
    module = ModuleType(name)
    module.__dict__.update(content)
    return module


class Argument:
    def __init__(self, name):
        self.name = name

    def perform(self, context):
        return context[self.name]


@pytest.fixture
def launch_file(monkeypatch):
    def keep(*args, **kwargs):
        return SimpleNamespace(args=args, **kwargs)

    monkeypatch.setitem(sys.modules, "launch", stand_in("launch", LaunchContext=dict, LaunchDescription=keep))
    actions = stand_in("launch.actions", DeclareLaunchArgument=keep, OpaqueFunction=keep)
    monkeypatch.setitem(sys.modules, "launch.actions", actions)
    monkeypatch.setitem(
        sys.modules, "launch.substitutions", stand_in("launch.substitutions", LaunchConfiguration=Argument)
    )
    monkeypatch.setitem(sys.modules, "launch_ros", stand_in("launch_ros"))
    monkeypatch.setitem(sys.modules, "launch_ros.actions", stand_in("launch_ros.actions", Node=keep))
    spec = importlib.util.spec_from_file_location("flight_launch", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def told(launch_file, **changes):
    """Return {role: node} for the launch arguments ``changes``."""
    defaults = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}
    return {node.name: node for node in launch_file.nodes({**defaults, **changes})}


def test_five_nodes_with_what_ros2_run_would_start(launch_file):
    nodes = told(launch_file)
    assert {name: (node.package, node.executable) for name, node in nodes.items()} == {
        "simulator": ("quad_dynamics", "simulator"),
        "trajectory": ("quad_trajectory", "trajectory"),
        "position_controller": ("quad_position_ctrl", "position_controller"),
        "attitude_controller": ("quad_attitude_ctrl", "attitude_controller"),
        "recorder": ("quad_flight_log", "recorder"),
    }


def test_namespace_time_and_files_are_passed_through(launch_file):
    nodes = told(
        launch_file, namespace="uav1", use_sim_time="true", case="case2", params_file="last.yaml", directory="bag"
    )
    for name, node in nodes.items():
        files = [Path(entry).name for entry in node.parameters if isinstance(entry, str)]
        assert files == ["paper.yaml", "tuned.yaml", "case2.yaml", "last.yaml"]
        values = {key: value for entry in node.parameters if isinstance(entry, dict) for key, value in entry.items()}
        assert values == {"use_sim_time": True} | ({"directory": "bag"} if name == "recorder" else {})
        assert node.namespace == "uav1"


def test_the_simulator_can_be_left_out(launch_file):
    assert "simulator" not in told(launch_file, simulate="false")
    assert len(told(launch_file, simulate="false")) == 4


def test_an_unknown_case_is_refused_by_name(launch_file):
    with pytest.raises(ParameterError, match="orbit"):
        told(launch_file, case="orbit")


def test_every_argument_is_declared(launch_file):
    *declared, late = launch_file.generate_launch_description().args[0]
    assert [entry.args[0] for entry in declared] == list(launch_file.ARGUMENTS)
    assert late.function is launch_file.nodes
