"""Every public number names its unit: in messages, in what flows between the stages, in parameters, in plant states."""

import ast
import importlib
import inspect
import pkgutil
import re
from pathlib import Path
from typing import Annotated, get_origin, get_type_hints

import pytest

import quad_autopilot
import quad_commander
import quad_core
import quad_px4
from quad_core import plugins, types
from quad_core.cascade import STAGES
from quad_core.parameters import Real, Whole, fields

pytestmark = pytest.mark.unit
MESSAGES = sorted((Path(__file__).resolve().parents[1] / "src" / "quad_msgs" / "msg").glob("*.msg"))
MESSAGE_FLOAT = re.compile(r"^float(?:32|64)(?:\[[^\]]*\])? +(\w+) *(?:# \[([^\]]*)\])?", re.MULTILINE)
NAMED_ELSEWHERE = {"extra"}
"""Numbers of third-party laws: their names and units are the law's own."""
COMMENT = re.compile(r"# \[([^\]]*)\]")
HOLDERS = {"Vec3", "Quat", "Rotors"}
"""Triples and quadruples: the field that holds one names the unit."""
NUMBERS = {"float", *HOLDERS}
# degrees of a map and gauss are what autopilots send; sqrt(Hz) and sqrt(s) belong to densities of noise
UNIT = re.compile(
    r"(?:1|mixed|steps|(?:kg|m|s|rad|deg|N|V|Hz|ns|GB|Pa|gauss|%)(?:\^\d)?)"
    r"(?:[ /](?:(?:kg|m|s|rad|N)(?:\^\d)?|sqrt\((?:Hz|s)\)))*"
)


def units_in(module):
    """Return {(class, field): unit, None without one} of every number in the NamedTuples that ``module`` defines."""
    source = inspect.getsource(module)
    lines, found = source.splitlines(), {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef) and node.name not in HOLDERS and "NamedTuple" in map(ast.unparse, node.bases):
            for field in node.body:
                if isinstance(field, ast.AnnAssign) and ast.unparse(field.annotation) in NUMBERS:
                    unit = COMMENT.search(lines[field.lineno - 1])
                    found[node.name, ast.unparse(field.target)] = unit[1] if unit else None
    return found


def units_of_messages():
    return {
        (path.stem, name): unit or None
        for path in MESSAGES
        for name, unit in MESSAGE_FLOAT.findall(path.read_text(encoding="utf-8"))
        if name not in NAMED_ELSEWHERE
    }


def plugin_parameters():
    for group in (*(stage.group for stage in STAGES), *plugins.OTHERS):
        for name in plugins.names(group):
            yield pytest.param(plugins.load(group, name).Parameters, id=f"{group}:{name}")


def test_every_number_of_a_message_has_a_unit():
    found = units_of_messages()
    assert len(found) > 50
    assert {key: unit for key, unit in found.items() if unit is None or not UNIT.fullmatch(unit)} == {}


def test_every_number_between_the_stages_has_a_unit():
    found = units_in(types)
    assert len(found) > 60
    assert {key: unit for key, unit in found.items() if unit is None or not UNIT.fullmatch(unit)} == {}


def test_a_message_and_its_type_agree_on_every_unit():
    mine, theirs = units_in(types), units_of_messages()
    shared = set(mine) & set(theirs)
    assert len(shared) > 45
    assert {key: (mine[key], theirs[key]) for key in shared if mine[key] != theirs[key]} == {}


@pytest.mark.parametrize("name", plugins.names(plugins.PLANT))
def test_every_number_of_a_plant_state_has_a_unit(name):
    state = plugins.load(plugins.PLANT, name).State
    found = {key: unit for key, unit in units_in(inspect.getmodule(state)).items() if key[0] == state.__name__}
    assert found
    assert {key: unit for key, unit in found.items() if unit is None or not UNIT.fullmatch(unit)} == {}


def parameter_sets():
    """Return every NamedTuple that declares parameters in packages without ROS: vehicle, nodes, guard, modes, ..."""
    for package in (quad_core, quad_commander, quad_autopilot, quad_px4):
        for module in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
            for name, kind in vars(importlib.import_module(module.name)).items():
                if getattr(kind, "__module__", "") == module.name and getattr(kind, "_field_defaults", ()):
                    hints = get_type_hints(kind, include_extras=True)
                    if any(get_origin(hint) is Annotated for hint in hints.values()):
                        yield pytest.param(kind, id=f"{module.name}.{name}")


PARAMETER_SETS = list(parameter_sets())


def test_guard_and_commander_are_among_the_parameter_sets():
    names = {parameter.values[0].__name__ for parameter in PARAMETER_SETS}
    assert {"Vehicle", "FlightParameters", "GuardParameters", "StateLimits", "ModeParameters", "ArmingLimits"} <= names


@pytest.mark.parametrize("parameters", [*plugin_parameters(), *PARAMETER_SETS])
def test_every_number_of_a_parameter_set_has_a_unit_and_a_meaning(parameters):
    for field in fields(parameters):
        if isinstance(field.spec, Real | Whole):
            # "": a ratio, a count, never a gain; several: what holds for axes of both kinds
            units = field.spec.unit.split(", ")
            assert units == [""] or all(map(UNIT.fullmatch, units)), (field.name, field.spec.unit)
            assert field.spec.unit or not field.name.endswith("gain"), field.name
            assert field.spec.meaning, field.name


@pytest.mark.parametrize("text", ["metres", "m/s/", "", "m^", "kilo"])
def test_what_is_no_unit_is_seen(text):
    assert UNIT.fullmatch(text) is None
