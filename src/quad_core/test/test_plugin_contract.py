"""Plug-ins by name: what is missing in one is named, and every installed one keeps the contract."""

import sys
from importlib.metadata import EntryPoint
from types import ModuleType

import pytest

from quad_core import plugins
from quad_core.parameters import build, flatten

GROUPS = (plugins.POSITION_LAW, plugins.ATTITUDE_LAW, plugins.TRAJECTORY, plugins.PLANT, plugins.DISTURBANCE)


@pytest.fixture
def register(monkeypatch):
    """Return a function that registers a module with the given names in a group."""
    plugins.load.cache_clear()

    def put(group, name, **content):
        module = ModuleType(f"made_up_{name}")
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, module.__name__, module)
        points = [EntryPoint(name, module.__name__, group)]
        monkeypatch.setattr(plugins, "entry_points", lambda group: [point for point in points if point.group == group])
        return module

    yield put
    plugins.load.cache_clear()


def test_a_complete_module_is_loaded_by_name(register):
    module = register(plugins.DISTURBANCE, "breeze", Parameters=tuple, draw=len, sample=len)
    assert plugins.names(plugins.DISTURBANCE) == ["breeze"]
    assert plugins.load(plugins.DISTURBANCE, "breeze") is module


@pytest.mark.parametrize(
    ("group", "given", "missing"),
    [
        (plugins.POSITION_LAW, ("Parameters", "Memory", "init"), ["Internals", "step"]),
        (plugins.ATTITUDE_LAW, ("Parameters", "Memory", "Internals", "step"), ["init"]),
        (plugins.TRAJECTORY, ("Parameters", "Plan", "plan", "sample"), ["duration"]),
        (plugins.PLANT, ("Parameters", "State", "init", "step"), ["observe", "lumped"]),
        (plugins.DISTURBANCE, (), ["Parameters", "draw", "sample"]),
    ],
)
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
