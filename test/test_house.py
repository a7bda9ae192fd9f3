"""No function is longer than a screen or two, and no imports form a circle."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

pytestmark = pytest.mark.unit

ROOT = Path(__file__).resolve().parents[1]
MODULES = {
    ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for package in sorted(ROOT.glob("src/*/quad_*"))
    if (package / "__init__.py").is_file()
    for path in sorted(package.rglob("*.py"))
}
LONGEST_FUNCTION = 60
ONE_TEXT = {("quad_flight.loop", "fly")}
"""Functions that are one text on purpose: the loop, because every call in it is inlined by hand or by Numba."""


@pytest.mark.parametrize("name", MODULES)
def test_no_function_is_longer_than_a_screen_or_two(name):
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef) and (name, node.name) not in ONE_TEXT:
            assert node.end_lineno - node.lineno < LONGEST_FUNCTION, node.name


def imported(tree):
    """Return the modules of ours that a tree imports anywhere, those inside functions too."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= (inner & MODULES.keys()) or {node.module}
    return found & MODULES.keys()


def test_no_circle_of_imports_not_even_one_hidden_inside_a_function():
    graph = {name: imported(ast.parse(path.read_text(encoding="utf-8"))) - {name} for name, path in MODULES.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


WITHOUT_ROS = ("quad_core", "quad_guard", "quad_flight", "quad_commander")

ROS_SIDE = ("node.py", "command.py", "preflight.py")
"""Modules of the commander that talk to ROS; all its others decide without."""


def test_packages_of_the_flight_without_ros_import_nothing_of_ros():
    for name, path in MODULES.items():
        if name.split(".")[0] in WITHOUT_ROS and path.name not in ROS_SIDE:
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
                for found in names:
                    assert found.split(".")[0] not in ("rclpy", "quad_msgs", "quad_node", "ament_index_python"), name


def private_names(definition, contexts=(ast.Store,)):
    """Return the private attributes that the methods of a class assign to itself, or use in other ``contexts``."""
    return {
        node.attr
        for node in ast.walk(definition)
        if isinstance(node, ast.Attribute)
        and isinstance(node.ctx, contexts)
        and isinstance(node.value, ast.Name)
        and node.value.id == "self"
        and node.attr.startswith("_")
    }


def test_no_class_reads_a_private_name_that_is_not_its_own():
    for path in MODULES.values():
        for definition in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(definition, ast.ClassDef) or not definition.bases:
                continue
            own = private_names(definition) | {
                name
                for node in definition.body
                for name in (
                    [node.name]
                    if isinstance(node, ast.FunctionDef)
                    else [target.id for target in getattr(node, "targets", [getattr(node, "target", None)]) if target]
                )
            }
            read = {name for name in private_names(definition, (ast.Load, ast.Store)) if not name.startswith("__")}
            assert read <= own, (str(path), definition.name, read - own)


def test_no_class_uses_a_private_name_of_its_base_for_something_else():
    classes = {
        node.name: ({base.id for base in node.bases if isinstance(base, ast.Name)}, private_names(node))
        for path in MODULES.values()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
    }

    def bases(name):
        for base in classes[name][0] & {*classes}:
            yield base
            yield from bases(base)

    for name, (_, own) in classes.items():
        for base in bases(name):
            assert not own & classes[base][1], (name, base)
