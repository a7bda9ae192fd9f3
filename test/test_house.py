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
ONE_TEXT = {("quad_flight.loop", "fly_of"), ("quad_flight.loop", "fly")}
"""Functions that are one text on purpose: the loop, whose calls Numba inlines."""


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


RUN_BY_HAND = [
    path for folder in ("test", "bench", "studies", "scripts/lib") for path in ROOT.glob(f"{folder}/**/*.py")
]


def given(tree):
    """Return the names that a module gives."""
    found = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {alias.asname or alias.name for alias in node.names}
    return found


def test_what_no_part_of_ci_runs_imports_names_that_there_are():
    names = {name: given(ast.parse(path.read_text(encoding="utf-8"))) for name, path in MODULES.items()}
    for path in RUN_BY_HAND:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module in names:
                for alias in node.names:
                    there = alias.name in names[node.module] or f"{node.module}.{alias.name}" in MODULES
                    assert there, f"{path.relative_to(ROOT)}:{node.lineno}: {node.module} has no {alias.name}"


WITHOUT_ROS = (
    *("quad_core", "quad_guard", "quad_flight", "quad_commander"),
    *("quad_log_import", "quad_analysis", "quad_report", "quad_identify"),
)

ROS_SIDE = ("node.py", "command.py", "preflight.py", "services.py")
"""Modules of the commander that talk to ROS; all its others decide without."""


def test_packages_of_the_flight_without_ros_import_nothing_of_ros():
    for name, path in MODULES.items():
        if name.split(".")[0] in WITHOUT_ROS and path.name not in ROS_SIDE:
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
                for found in names:
                    assert found.split(".")[0] not in ("rclpy", "quad_msgs", "quad_node", "ament_index_python"), name
