"""The five nodes need rclpy, common_interfaces, numpy, mcap, PyYAML and quad_msgs alone, started in any order."""

import importlib.metadata
import json
import os
import random
import re
import subprocess
import sys
import time

import pytest
from flying import CONFIG, ROLES, ROOT, executable
from test_same_bits import assert_same

from quad_bringup.surroundings import reserved_domain
from quad_flight.flight import fly, from_names
from quad_flight_log.reader import open_flight

pytestmark = [pytest.mark.flight, pytest.mark.timeout(600)]

# A sourced ROS brings what it brings: there only the wheels show what is needed.
if "QUAD_ROS=''" not in (ROOT / "install/env.bash").read_text(encoding="utf-8"):
    pytest.skip("ROS 2 is sourced", allow_module_level=True)

WHERE = ROOT / ".cache" / "minimal"
ASKED = {"numpy", "mcap", "pyyaml"}
BROUGHT = {"lz4", "zstandard", "empy", "lark-parser", "setuptools", "pip"}  # by mcap, by the ROS wheels, by venv
ROS = re.compile(r"ros-|rosidl_|rclpy$|rcutils$|rmw_|\w+_(msgs|interfaces|srvs)$")
LIST = """
import importlib.metadata as m, json
print(json.dumps([d.metadata["Name"] for d in m.distributions(path=__import__("site").getsitepackages())]))
"""
NOTHING_ELSE = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {others}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Absent())
"""
"""Read by Python as it starts: hides the other packages of the environment that runs the tests."""


def belongs(name):
    """Return whether the environment that the users asked for holds the distribution ``name``."""
    return name.lower() in ASKED | BROUGHT or bool(ROS.match(name.lower()))


@pytest.fixture(scope="module")
def minimal():
    """Return the variables of the environment, made by scripts/setup."""
    done = subprocess.run(
        [ROOT / "scripts/setup", "--minimal", WHERE], capture_output=True, text=True, timeout=550, check=False
    )
    assert done.returncode == 0, done.stderr
    return {"HOME": os.environ["HOME"], "PATH": "/usr/bin:/bin", "QUAD_VENV": str(WHERE)}


def command(*words):
    """Return ``words`` as a command of the environment's own Python, after scripts/env.sh."""
    return ["bash", "-c", 'source "$0" && exec "$VIRTUAL_ENV/bin/python" "$@"', str(ROOT / "scripts/env.sh"), *words]


def test_five_nodes_fly_in_an_environment_that_holds_nothing_else(minimal, tmp_path):
    listed = subprocess.run(command("-c", LIST), env=minimal, capture_output=True, text=True, timeout=60, check=True)
    names = {name.lower() for name in json.loads(listed.stdout)}
    assert names >= ASKED
    assert all(map(belongs, names)), names
    for file in ("extras", "dev"):
        lines = (ROOT / f"requirements/{file}.txt").read_text(encoding="utf-8").splitlines()
        assert not names & {line.strip().lower() for line in lines}
    order = random.Random(4).sample(list(ROLES), len(ROLES))
    assert_five_nodes_fly(lambda role: command(executable(role)), minimal, tmp_path, order)


def test_five_nodes_fly_where_nothing_else_can_be_imported(tmp_path):
    tops = importlib.metadata.packages_distributions()
    others = {top for top, names in tops.items() if not any(belongs(name) or "quad" in name for name in names)}
    assert {"numba", "scipy", "matplotlib", "pytest"} <= others
    assert not {"numpy", "mcap", "yaml", "rclpy", "geometry_msgs"} & others
    (tmp_path / "sitecustomize.py").write_text(NOTHING_ELSE.format(others=others), encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    tried = subprocess.run([sys.executable, "-c", "import scipy"], env=environment, capture_output=True, check=False)
    assert b"ModuleNotFoundError: No module named 'scipy'" in tried.stderr
    assert_five_nodes_fly(lambda role: [executable(role)], environment, tmp_path, reversed(ROLES))


def assert_five_nodes_fly(started_by, environment, tmp_path, order):
    """Start the nodes one after the other; the flight has the bits of the flight without ROS."""
    choices = ["--ros-args", "--params-file", f"{CONFIG}/scenarios/hover.yaml", "-p", "trajectory:hover.duration:=0.2"]
    with reserved_domain(None) as domain:
        nodes = {}
        for role in order:
            own = ["-p", f"directory:={tmp_path}/bag"] if role == "recorder" else []
            nodes[role] = subprocess.Popen(
                [*started_by(role), *choices, *own],
                env={**environment, "ROS_DOMAIN_ID": str(domain)},
                stderr=subprocess.PIPE,
                text=True,
            )
            time.sleep(0.5)
        try:
            errors = {role: node.communicate(timeout=150)[1] for role, node in nodes.items()}
        finally:
            for node in nodes.values():
                node.kill()
    assert {role: node.returncode for role, node in nodes.items()} == dict.fromkeys(ROLES, 0), errors
    bag = open_flight(tmp_path / "bag")
    assert bag.metadata["outcome"] == "ended"
    assert_same(bag, fly(from_names("hover", duration=0.2)))
