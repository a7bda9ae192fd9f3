"""The launch file against stand-ins for launch, which is no wheel: the words that fly is started with, and its end."""

import functools
import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from quad_bringup import fly

FILE = Path(__file__).parents[1] / "launch" / "flight.launch.py"


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
    """Return the module, as ``ros2 launch`` loads it when a user names it."""

    def keep(*args, **kwargs):
        return SimpleNamespace(args=args, **kwargs)

    def stand_in(name, **content):
        module = ModuleType(name)
        module.__dict__.update(content)
        monkeypatch.setitem(sys.modules, name, module)

    names = "DeclareLaunchArgument ExecuteProcess OpaqueFunction"
    stand_in("launch", LaunchContext=dict, LaunchDescription=keep)
    stand_in("launch.actions", **{name: functools.partial(keep, kind=name) for name in names.split()})
    stand_in("launch.substitutions", LaunchConfiguration=Argument)
    monkeypatch.setenv("ROS_DOMAIN_ID", "")
    monkeypatch.setattr(sys, "argv", ["ros2", "launch", "quad_bringup", FILE.name])
    spec = importlib.util.spec_from_file_location("flight_launch", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def started(launch_file, **changes):
    """Return the one process of a launch with the launch arguments ``changes``."""
    defaults = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}
    (process,) = launch_file.flight(Context({**defaults, **changes}))
    return process


def options(launch_file, **changes):
    """Return what fly makes of the words that it is started with."""
    program, *words = started(launch_file, **changes).cmd
    assert program.endswith("/lib/quad_bringup/fly")
    return fly._parser().parse_args(words)


def test_without_arguments_it_is_the_flight_of_scripts_fly_in_the_domain_of_the_shell(launch_file, monkeypatch):
    assert vars(options(launch_file)) == {**vars(fly._parser().parse_args([])), "domain": 0}
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert options(launch_file).domain == 7


def test_every_argument_reaches_fly(launch_file):
    given = {"case": "case2", "mission": "takeoff,case2,goto:1 2 3 -90deg,land", "vehicle": "x500", "preset": "x500"}
    given |= {"params_file": "last.yaml", "directory": "bag", "limits": "position_rmse=0.1", "namespace": "uav1"}
    given |= {"realtime": "True", "visible": "true", "options": "--domain 9 --seed 7 --set 'a.b=0 0 1'"}
    assert given.keys() == launch_file.ARGUMENTS.keys()
    found = options(launch_file, **given)
    for name, value in (("scenario", "last.yaml"), ("out", Path("bag")), ("limits", ["position_rmse=0.1"])):
        assert getattr(found, name) == value
    for name in ("case", "mission", "vehicle", "preset", "namespace"):
        assert getattr(found, name) == given[name]
    assert (found.realtime, found.visible, found.seed, found.domain) == (True, True, 7, 9)
    assert found.settings == ["a.b=0 0 1"]


@pytest.mark.parametrize(("typed", "changes", "words"), [
    (["cas:=hover"], {}, "found argument 'cas' (did you mean case?)"),
    ([], {"realtime": "maybe"}, "realtime: found 'maybe', expected true or false"),
    ([], {"options": "--set 'a"}, 'options: found "--set \'a", expected words as in a shell: No closing quotation'),
])  # fmt: skip
def test_what_is_not_understood_is_refused_in_one_line_with_exit_code_2(
    launch_file, capsys, monkeypatch, typed, changes, words
):
    monkeypatch.setattr(Context, "argv", typed)
    with pytest.raises(SystemExit) as ended:
        started(launch_file, **changes)
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line


@pytest.mark.parametrize("code", [0, 1, 2])
def test_launch_ends_with_the_exit_code_of_fly(launch_file, code):
    with pytest.raises(SystemExit) as left:
        started(launch_file).on_exit(SimpleNamespace(returncode=code), {})
    assert left.value.code == code


@pytest.mark.parametrize("name", ["mine.launch.py", "my_flight.launch.py"])
def test_a_file_that_includes_this_one_has_arguments_and_an_end_of_its_own(name, launch_file, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["ros2", "launch", name, "cas:=hover"])
    monkeypatch.setattr(Context, "argv", ["cas:=hover"])
    assert started(launch_file).on_exit(SimpleNamespace(returncode=1), {}) is None


def test_launch_lets_a_vehicle_land_before_it_asks_again(launch_file):
    """A second signal stops the motors; by itself launch sends it 5 s after Ctrl-C."""
    process = started(launch_file)
    assert min(int(process.sigterm_timeout), int(process.sigkill_timeout)) > 4 * 3600
