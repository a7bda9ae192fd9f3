"""Each package.xml names what its modules import, by keys that rosdep resolves, and colcon finds only our packages."""

import ast
import re
import sys
from pathlib import Path

import pytest
from ament_index_python import get_package_share_directory
from flying import ROOT

PACKAGES = sorted(path.parent for path in (ROOT / "src").glob("*/package.xml"))
KEYS = {
    "mcap": "mcap-ros2-support",
    "mujoco": "python3-mujoco-pip",
    "numba": "python3-numba",
    "numpy": "python3-numpy",
    "pandas": "python3-pandas",
    "rosbags": "python3-rosbags-pip",
    "scipy": "python3-scipy",
    "yaml": "python3-yaml",
}
"""rosdep's key of each Python module that the packages import at module level; a ROS package is its own key."""
UNKNOWN_TO_ROSDEP = {"zstandard", "lz4"}
"""Modules without a key of their own: the package of mcap brings them."""


def imports_at_module_level(package):
    found = set()
    for path in package.rglob("*.py"):
        if "test" in path.parts or path.name == "setup.py":
            continue
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module and not node.level else []
            found |= {name.partition(".")[0] for name in names}
    return found - set(sys.stdlib_module_names) - {package.name}


def dependencies(package):
    text = (package / "package.xml").read_text(encoding="utf-8")
    return set(re.findall(r"<(?:exec_depend|depend|build_depend)>([^<]+)<", text))


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_a_package_names_what_it_imports_by_keys_that_rosdep_knows_and_is_tested_by_pytest(package):
    needed = {KEYS.get(name, name) for name in imports_at_module_level(package) - UNKNOWN_TO_ROSDEP}
    assert needed <= dependencies(package), needed - dependencies(package)
    python = {key for key in dependencies(package) if key.startswith("python3-") or key in KEYS.values()}
    assert python <= {*KEYS.values(), "python3-pytest"}
    setup = package / "setup.py"
    assert not setup.exists() or 'extras_require={"test": ["pytest"]}' in setup.read_text(encoding="utf-8")


@pytest.mark.parametrize("folder", ["wheels", "test", "examples"])
def test_a_clone_in_a_workspace_hides_no_package_of_the_user(folder):
    """``colcon build`` of a clone in ``ws/src`` leaves stand-ins (px4_msgs, tf2_msgs) and examples out."""
    assert (ROOT / folder / "COLCON_IGNORE").is_file()


def test_the_configuration_lies_in_share_where_users_of_ros_look_for_it():
    share, source = Path(get_package_share_directory("quad_flight")), ROOT / "src/quad_flight/quad_flight"
    files = sorted(path.relative_to(source) for path in source.glob("config/*/*.yaml"))
    assert files
    assert [(share / path).read_bytes() for path in files] == [(source / path).read_bytes() for path in files]
