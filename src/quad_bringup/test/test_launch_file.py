"""The launch file against stand-ins for launch and launch_ros, which are no wheels: nodes and their parameters."""

import functools
import importlib.util
import os
import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from quad_bringup import results
from quad_flight_log.analysis.metrics import FlightMetrics
from quad_node.middleware import CLOSED, OPEN, PROFILES, RANGE, SETTINGS, TRANSPORTS

FILE = Path(__file__).parents[1] / "launch" / "flight.launch.py"


def stand_in(name, **content):
    module = ModuleType(name)
    module.__dict__.update(content)
    return module


class Context(dict):
    """Launch arguments by name; ``argv``: as a user typed them."""

    argv = ()


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


def context(launch_file, **changes):
    """Return the context of a launch with the launch arguments ``changes``."""
    defaults = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}
    return Context({**defaults, **changes})


def whole(launch_file, **changes):
    """Return all that is launched for the launch arguments ``changes``."""
    return launch_file.flight(context(launch_file, **changes))


def refusal(launch_file, capsys, **changes):
    """Return the one line with which these launch arguments are refused, with exit code 2."""
    with pytest.raises(SystemExit) as ended:
        whole(launch_file, **changes)
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


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


def test_an_unknown_case_is_refused_by_name(launch_file, capsys):
    assert "orbit" in refusal(launch_file, capsys, case="orbit")


def test_an_unknown_argument_is_refused_with_the_nearest_name(launch_file, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["ros2", "launch", "quad_bringup", "flight.launch.py", "cas:=hover"])
    monkeypatch.setattr(Context, "argv", ("cas:=hover",))
    assert "found argument 'cas' (did you mean case?)" in refusal(launch_file, capsys)
    monkeypatch.setattr(sys, "argv", ["ros2", "launch", "mine.launch.py", "cas:=hover"])
    assert len(started_nodes(launch_file)) == 5  # the file that includes this one may have such an argument


def test_a_limit_of_no_metric_and_a_directory_that_exists_are_refused(launch_file, capsys, tmp_path):
    assert "'position_rms'" in refusal(launch_file, capsys, limits="position_rms=1")
    assert "exists" in refusal(launch_file, capsys, directory=str(tmp_path))


def test_a_bag_gets_a_directory_that_is_free(launch_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flights/hover-launch-1").mkdir(parents=True)
    recorder = started_nodes(launch_file, case="hover")["recorder"]
    assert {"directory": "flights/hover-launch-2"} in recorder.parameters


@pytest.mark.parametrize(
    ("changes", "case"),
    [({}, "case1"), ({"mission": "takeoff,case2,land"}, "case2"), ({"mission": "takeoff,land"}, "hover")],
)
def test_a_flight_is_named_by_what_it_flies(launch_file, changes, case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recorder = started_nodes(launch_file, **changes)["recorder"]
    assert {"directory": f"flights/{case}-launch-1"} in recorder.parameters


def test_a_flight_of_which_nothing_was_measured_shows_no_empty_table():
    found = results.Report("ended", 12.0, 6.0, FlightMetrics(), {}, [], "metrics are those of mode MISSION alone")
    assert results.text("hover", found, "seed 1").splitlines() == [
        "hover: no metrics: metrics are those of mode MISSION alone",
        "seed 1; 12.00 s flown at 6.00 x real time; ended",
    ]
    measured = found._replace(metrics=FlightMetrics(position_rmse=0.01))
    assert "position_rmse" in results.text("hover", measured, "seed 1")


def test_every_argument_is_declared(launch_file):
    *declared, late = launch_file.generate_launch_description().args[0]
    assert [entry.args[0] for entry in declared] == list(launch_file.ARGUMENTS)
    assert late.function is launch_file.flight


@pytest.mark.parametrize("name", ["simulate", "use_sim_time", "visible"])
def test_a_flag_is_true_or_false(launch_file, name, capsys):
    assert f"{name}: found 'maybe', expected true or false" in refusal(launch_file, capsys, **{name: "maybe"})


def test_a_parameter_file_that_does_not_exist_is_refused(launch_file, capsys):
    assert "params_file: found 'none.yaml'" in refusal(launch_file, capsys, params_file="none.yaml")


@pytest.mark.parametrize(("code", "ends"), [(0, 0), (1, 0), (-9, 0), (2, 1)])
def test_a_refused_node_ends_the_others(launch_file, code, ends):
    event = SimpleNamespace(returncode=code, action=SimpleNamespace(name="trajectory"))
    node, *_ = started_nodes(launch_file).values()
    actions = node.on_exit(event, {})
    assert [action.kind for action in actions] == ["Shutdown"] * ends
    assert all("trajectory" in action.reason for action in actions)


@pytest.mark.parametrize(
    ("codes", "problems", "ended"),
    [([0] * 5, [], 0), ([0] * 5, ["too far"], 1), ([1, 0, 0, 0, 0], ["it fell"], 1), ([0, 2, 0, 0, 0], [], 2)],
)
def test_the_exit_of_the_last_node_ends_launch_with_the_verdict(
    launch_file, codes, problems, ended, monkeypatch, capsys
):
    found = results.Report("ended", 1.0, 1.0, FlightMetrics(), {}, problems)
    monkeypatch.setattr(launch_file.results, "report", lambda *_: found)
    nodes = list(started_nodes(launch_file).values())
    *first, last = [SimpleNamespace(returncode=code, action=SimpleNamespace(name="x")) for code in codes]
    for node, event in zip(nodes, first, strict=False):
        node.on_exit(event, {})
    with pytest.raises(SystemExit) as left:
        nodes[-1].on_exit(last, {})
    assert left.value.code == ended
    assert all(problem in capsys.readouterr().out for problem in problems)


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
    assert {(node.sigterm_timeout, node.sigkill_timeout) for node in nodes.values()} == {("14400", "14405")}


def test_a_mission_that_cannot_be_flown_is_refused(launch_file, capsys):
    assert "mission: found 'case9' as item 2" in refusal(launch_file, capsys, mission="takeoff,case9")
