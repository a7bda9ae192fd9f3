"""Plug-ins by name: what is missing in one is named, and every installed one keeps the contract."""

import sys
from importlib.metadata import EntryPoint, EntryPoints
from types import ModuleType
from typing import Annotated, NamedTuple

import pytest

from quad_core import plugins
from quad_core.parameters import Real, build, flatten

GROUPS = (plugins.POSITION_LAW, plugins.ATTITUDE_LAW, plugins.TRAJECTORY, plugins.PLANT, plugins.DISTURBANCE)


@pytest.fixture
def register(monkeypatch):
    """Return a function that registers a module with the given names in a group."""
    plugins.load.cache_clear()

    def put(group, name, **content):
        module = ModuleType(f"made_up_{name}")
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, module.__name__, module)
        points = EntryPoints([EntryPoint(name, module.__name__, group)])
        monkeypatch.setattr(plugins, "installed", lambda: points)
        return module

    yield put
    plugins.load.cache_clear()


@pytest.mark.parametrize(("group", "given", "missing"), [
    (plugins.POSITION_LAW, ("Parameters", "Memory", "init"), ["Internals", "step"]),
    (plugins.ATTITUDE_LAW, ("Parameters", "Memory", "Internals", "step"), ["init"]),
    (plugins.TRAJECTORY, ("Parameters", "Plan", "plan", "sample"), ["duration"]),
    (plugins.PLANT, ("Parameters", "State", "init", "step"), ["observe", "lumped"]),
    (plugins.DISTURBANCE, (), ["Parameters", "draw", "sample"]),
])  # fmt: skip
def test_what_a_module_lacks_is_named(register, group, given, missing):
    register(group, "half", **dict.fromkeys(given, len))
    with pytest.raises(plugins.PluginError) as caught:
        plugins.load(group, "half")
    text = str(caught.value)
    assert text.startswith(f"{group}: plug-in 'half' (made_up_half) lacks {', '.join(missing)}")


def test_an_unknown_name_and_an_empty_group_are_said(register):
    register(plugins.PLANT, "balloon")
    with pytest.raises(plugins.PluginError, match=r"quad\.plant: no plug-in named 'kite'; installed: balloon"):
        plugins.load(plugins.PLANT, "kite")
    with pytest.raises(plugins.PluginError, match=r"quad\.trajectory: no plug-in named 'kite'; installed: none"):
        plugins.load(plugins.TRAJECTORY, "kite")
    with pytest.raises(plugins.PluginError, match=r"installed: none; 'balloon' is a quad\.plant"):
        plugins.load(plugins.TRAJECTORY, "balloon")


def test_a_module_that_cannot_be_imported_is_said_with_its_name(register, monkeypatch):
    found = EntryPoints([EntryPoint("kite", "made_up_nowhere", plugins.PLANT)])
    monkeypatch.setattr(plugins, "installed", lambda: found)
    expected = r"quad\.plant: plug-in 'kite' \(made_up_nowhere\) cannot be imported: No module named 'made_up_nowhere'"
    with pytest.raises(plugins.PluginError, match=expected):
        plugins.load(plugins.PLANT, "kite")


@pytest.mark.parametrize(("text", "said"), [
    ("a = 1\nb = c\n", r"NameError: name 'c' is not defined \(.*/kite\.py, line 2\)"),
    ("a = 1\ndef b(:\n", r"SyntaxError: invalid syntax \(kite\.py, line 2\)"),
    ("a = 1 / 0\n", r"ZeroDivisionError: division by zero \(.*/kite\.py, line 1\)"),
])  # fmt: skip
def test_a_module_with_a_mistake_is_said_with_its_line(tmp_path, monkeypatch, text, said):
    (tmp_path / "kite.py").write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    found = EntryPoints([EntryPoint("kite", "kite", plugins.PLANT)])
    monkeypatch.setattr(plugins, "installed", lambda: found)
    plugins.load.cache_clear()
    monkeypatch.delitem(sys.modules, "kite", raising=False)
    with pytest.raises(plugins.PluginError, match=r"quad\.plant: plug-in 'kite' \(kite\) cannot be imported: " + said):
        plugins.load(plugins.PLANT, "kite")


def test_a_name_that_two_packages_took_is_refused(register, monkeypatch):
    module = register(plugins.DISTURBANCE, "breeze", Parameters=tuple, draw=len, sample=len)
    found = [EntryPoint("breeze", value, plugins.DISTURBANCE) for value in (module.__name__, "made_up_gale")]
    monkeypatch.setattr(plugins, "installed", lambda: EntryPoints(found))
    expected = "'breeze' is the name of several plug-ins: made_up_breeze, made_up_gale; rename one"
    with pytest.raises(plugins.PluginError, match=expected):
        plugins.load(plugins.DISTURBANCE, "breeze")
    found.pop()
    assert plugins.load(plugins.DISTURBANCE, "breeze") is module


class Bare(NamedTuple):
    gain: float = 3.0


class Nested(NamedTuple):
    inner: Bare = Bare()


class Undecided(NamedTuple):
    gain: Annotated[float, Real("1/s", "a gain", 0.0, 9.0)]


@pytest.mark.parametrize(("parameters", "said"), [
    (Bare, r"Bare: found gain: float, expected Annotated\[float, \.\.\.\] with Real, Whole, Flag or Choice"),
    (Nested, r"Bare: found inner\.gain: float, expected Annotated\[float, \.\.\.\]"),
    (Undecided, r"missing 1 required positional argument: 'gain'"),
])  # fmt: skip
def test_a_parameter_whose_value_would_be_lost_is_refused(register, parameters, said):
    register(plugins.DISTURBANCE, "breeze", Parameters=parameters, draw=len, sample=len)
    with pytest.raises(plugins.PluginError, match=r"plug-in 'breeze' \(made_up_breeze\): .*" + said):
        plugins.load(plugins.DISTURBANCE, "breeze")


@pytest.mark.parametrize("group", GROUPS)
def test_every_installed_plugin_is_complete_and_its_defaults_and_presets_are_in_range(group):
    found = plugins.names(group)
    if not found:
        pytest.skip("plug-ins are not installed: run scripts/setup")
    for name in found:
        module = plugins.load(group, name)
        assert build(module.Parameters, flatten(module.Parameters)) == module.Parameters()
        for preset in getattr(module, "PRESETS", {}).values():
            assert flatten(build(module.Parameters, preset)).items() >= preset.items()
