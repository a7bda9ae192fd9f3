"""What packages register: rows in the order of the data flow, and mistakes named by entry point."""

import importlib

import pytest

from quad_core import plugins
from quad_core.plugins import PluginError
from quad_core.roles import Input, Role, Stage, VehicleInterface, in_order, registered
from quad_core.types import AttitudeThrust, Wrench


def stage(role, takes, gives, output=Wrench, lag=0):
    inputs = tuple(Input(topic, lag) for topic in takes)
    return Stage(role, "package", "group", tuple, tuple, inputs, gives, output, tuple)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return a function that installs a package with these lines of entry points and a module of two rows."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "registered_rows.py").write_text(
        "from quad_core.roles import Role, VehicleInterface\n"
        "ROLE = Role('registered_rows', tuple, {})\n"
        "VEHICLE = VehicleInterface('registered_rows', tuple, {}, 'mine')\n"
    )

    def install(name, lines):
        folder = tmp_path / f"{name}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", "utf-8")
        (folder / "entry_points.txt").write_text(f"[quad.made_up]\n{lines}\n", "utf-8")
        importlib.invalidate_caches()
        plugins.installed.cache_clear()

    yield install
    plugins.installed.cache_clear()


def test_a_stage_stands_after_those_whose_output_it_takes():
    first = stage("z", ("reference",), "setpoint", AttitudeThrust)
    second, third = stage("y", ("setpoint",), "wrench"), stage("a", ("wrench",), "filtered")
    assert in_order((third, second, first)) == (first, second, third)


def test_an_output_of_the_step_before_is_not_waited_for():
    first, second = stage("a", ("wrench",), "setpoint", AttitudeThrust, lag=1), stage("b", ("setpoint",), "wrench")
    assert in_order((second, first)) == (first, second)


@pytest.mark.parametrize(("stages", "message"), [
    ((), "found no stage last"),
    ((stage("a", ("reference",), "setpoint", AttitudeThrust),), "found a last, expected a stage that gives a wr"),
    ((stage("a", ("y",), "x"), stage("b", ("x",), "y")), "a, b wait for one another"),
])  # fmt: skip
def test_stages_that_make_no_cascade_are_refused(stages, message):
    with pytest.raises(PluginError, match=message):
        in_order(stages)


def test_rows_are_found_by_role(package):
    package("one", "second = registered_rows:VEHICLE")
    package("two", "first = registered_rows:VEHICLE")
    found = registered("quad.made_up", VehicleInterface)
    assert list(found) == ["first", "second"]
    assert found["first"].name == "mine"


@pytest.mark.parametrize(("lines", "kind", "message"), [
    ("mine = registered_rows:ROLE", VehicleInterface, r"mine \(registered_rows:ROLE\): found a Role, expected a"),
    ("mine = registered_rows:MISSING", Role, r"plug-in 'mine' \(registered_rows:MISSING\) cannot be imported"),
    ("mine = no_such_module:ROLE", Role, "cannot be imported: No module named 'no_such_module'"),
])  # fmt: skip
def test_a_row_that_cannot_be_used_is_named(package, lines, kind, message):
    package("one", lines)
    with pytest.raises(PluginError, match=message):
        registered("quad.made_up", kind)
