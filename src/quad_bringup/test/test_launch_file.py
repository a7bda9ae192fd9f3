"""The launch file against stand-ins for launch and launch_ros, which are no wheels: nodes and their parameters."""

import functools
import importlib.util
import os
import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from quad_core.parameters import ParameterError
from quad_node.middleware import CLOSED, OPEN, PROFILES, RANGE, SETTINGS, TRANSPORTS

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
    names = "DeclareLaunchArgument OpaqueFunction LogInfo Shutdown"
    actions = {name: functools.partial(keep, kind=name) for name in names.split()}
    monkeypatch.setitem(sys.modules, "launch.actions", stand_in("launch.actions", **actions))
    for name in (TRANSPORTS, PROFILES, RANGE, "RMW_IMPLEMENTATION", "ROS_DOMAIN_ID"):
        monkeypatch.setenv(name, "")
    monkeypatch.setitem(
        sys.modules, "launch.substitutions", stand_in("launch.substitutions", LaunchConfiguration=Argument)
    )
    monkeypatch.setitem(sys.modules, "launch_ros", stand_in("launch_ros"))
    monkeypatch.setitem(sys.modules, "launch_ros.actions", stand_in("launch_ros.actions", Node=keep))
    spec = importlib.util.spec_from_file_location("flight_launch", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def whole(launch_file, **changes):
    """Return all that is launched for the launch arguments ``changes``."""
    defaults = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}
    return launch_file.flight({**defaults, **changes})


def started_nodes(launch_file, **changes):
    """Return {role: node} for the launch arguments ``changes``."""
    return {action.name: action for action in whole(launch_file, **changes) if hasattr(action, "executable")}


def lines(actions):
    """Return the lines that are printed."""
    return " ".join(action.msg for action in actions if action.__dict__.get("kind") == "LogInfo")


def test_five_nodes_with_what_ros2_run_would_start(launch_file):
    nodes = started_nodes(launch_file)
    assert {name: (node.package, node.executable) for name, node in nodes.items()} == {
        "simulator": ("quad_dynamics", "simulator"),
        "trajectory": ("quad_trajectory", "trajectory"),
        "position_controller": ("quad_position_ctrl", "position_controller"),
        "attitude_controller": ("quad_attitude_ctrl", "attitude_controller"),
        "recorder": ("quad_flight_log", "recorder"),
    }


def test_namespace_time_and_files_are_passed_through(launch_file, tmp_path):
    last = tmp_path / "last.yaml"
    last.touch()
    nodes = started_nodes(
        launch_file, namespace="uav1", use_sim_time="true", case="case2", params_file=str(last), directory="bag"
    )
    for name, node in nodes.items():
        files = [Path(entry).name for entry in node.parameters if isinstance(entry, str)]
        assert files == ["paper.yaml", "tuned.yaml", "case2.yaml", "last.yaml"]
        values = {key: value for entry in node.parameters if isinstance(entry, dict) for key, value in entry.items()}
        assert values == {"use_sim_time": True} | ({"directory": "bag"} if name == "recorder" else {})
        assert node.namespace == "uav1"


def test_the_simulator_can_be_left_out(launch_file):
    assert "simulator" not in started_nodes(launch_file, simulate="false")
    assert len(started_nodes(launch_file, simulate="false")) == 4


def test_an_unknown_case_is_refused_by_name(launch_file):
    with pytest.raises(ParameterError, match="orbit"):
        started_nodes(launch_file, case="orbit")


def test_every_argument_is_declared(launch_file):
    *declared, late = launch_file.generate_launch_description().args[0]
    assert [entry.args[0] for entry in declared] == list(launch_file.ARGUMENTS)
    assert late.function is launch_file.flight


@pytest.mark.parametrize("name", ["simulate", "use_sim_time", "visible"])
def test_a_flag_is_true_or_false(launch_file, name):
    with pytest.raises(ParameterError, match=f"{name}: found 'maybe', expected true or false"):
        started_nodes(launch_file, **{name: "maybe"})


def test_a_parameter_file_that_does_not_exist_is_refused(launch_file):
    with pytest.raises(ParameterError, match=r"params_file: found 'none\.yaml'"):
        started_nodes(launch_file, params_file="none.yaml")


@pytest.mark.parametrize(("code", "ends"), [(0, 0), (1, 0), (-9, 0), (2, 1)])
def test_a_refused_node_ends_the_others(launch_file, code, ends):
    event = SimpleNamespace(returncode=code, action=SimpleNamespace(name="trajectory"))
    for node in started_nodes(launch_file).values():
        actions = node.on_exit(event, {})
        assert [action.kind for action in actions] == ["Shutdown"] * ends
        assert all("trajectory" in action.reason for action in actions)


def test_a_flight_is_closed_unless_the_user_has_chosen_transports(launch_file, monkeypatch):
    assert lines(whole(launch_file)) == f"{CLOSED}: export ROS_DOMAIN_ID=0; unset {TRANSPORTS}"
    assert (os.environ[PROFILES], os.environ.get(TRANSPORTS, "")) == (SETTINGS, "")
    monkeypatch.setenv(TRANSPORTS, "UDPv4")
    assert lines(whole(launch_file, visible="true")).startswith(CLOSED)
    assert os.environ.get(TRANSPORTS, "") == ""


@pytest.mark.parametrize(("name", "value"), [(TRANSPORTS, "UDPv4"), ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")])
def test_settings_of_the_user_stay_and_an_open_flight_is_a_warning(launch_file, monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    assert re.match(f"WARNING: {OPEN}: .*{value}", lines(whole(launch_file)))
    assert os.environ[name] == value


def test_a_mission_adds_the_commander_a_ground_and_time_to_land(launch_file):
    nodes = started_nodes(launch_file, mission="takeoff,case2,land")
    assert (nodes["commander"].package, nodes["commander"].executable) == ("quad_commander", "commander")
    own = {name: node.parameters[-1] for name, node in nodes.items()}
    assert {parameters["flight.roles"] for parameters in own.values()} == {
        "simulator,trajectory,position_controller,attitude_controller,recorder,commander"
    }
    assert len({parameters["flight.run_id"] for parameters in own.values()}) == 1
    assert own["commander"]["mission"] == "takeoff,case2,land"
    assert own["trajectory"]["trajectory"] == "case2"
    assert own["simulator"]["rigid_body.ground.height"] == pytest.approx(-0.099)


@pytest.mark.parametrize("mission", ["", "takeoff,land"])
def test_launch_lets_a_vehicle_land_before_it_asks_again(launch_file, mission):
    """The second signal to a vehicle's owner stops the motors; by itself launch sends it 5 s after Ctrl-C."""
    nodes = started_nodes(launch_file, mission=mission)
    assert {(node.sigterm_timeout, node.sigkill_timeout) for node in nodes.values()} == {("300", "305")}


def test_a_mission_that_cannot_be_flown_is_refused(launch_file):
    with pytest.raises(ParameterError, match=r"mission: found 'case9' as item 2"):
        started_nodes(launch_file, mission="takeoff,case9")
