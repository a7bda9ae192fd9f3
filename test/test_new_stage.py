"""A new stage between attitude law and plant: its own files, a patch of two places, and it flies without ROS."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.unit

ROOT = Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "examples" / "torque_filter"
FLY = """
import math, sys
import numpy as np
from quad_core.cascade import COMMAND, STAGES
from quad_flight import flight

assert [stage.role for stage in STAGES][2:] == ["torque_filter"] and COMMAND == "wrench_filtered"
settings = ["torque_filter.low_pass.time_constant=0.006", "torque_filter.period_steps=2"]
planned = flight.from_names("hover", duration=0.2, position="pid", attitude="pid", settings=settings)
plain = flight.fly(planned)
assert plain.outcome == "ended", plain.outcome
raw, smooth = plain.topics["wrench_setpoint"], plain.topics["wrench_filtered"]
assert len(smooth) == len(raw) // 2
expected = np.zeros(3)
for k, row in enumerate(smooth):
    expected = expected + (1.0 - math.exp(-0.004 / 0.006)) * (raw["torque_b"][2 * k] - expected)
    assert np.allclose(row["torque_b"], expected, rtol=1e-9, atol=1e-12), k
    removed = plain.topics["torque_filter/internals"]["removed_b"][k]
    assert np.allclose(removed, raw["torque_b"][2 * k] - row["torque_b"], rtol=1e-9, atol=1e-12), k
assert np.abs(raw["torque_b"]).max() > 0.0
# the plant obeys the filter, not the attitude law
assert np.allclose(plain.topics["actuation"]["torque_b"][::2], smooth["torque_b"], rtol=1e-6, atol=1e-9)
if sys.argv[1] == "compiled":
    fast = flight.fly(planned, compiled=True)
    assert fast._replace(topics={}) == plain._replace(topics={})
    for name, rows in plain.topics.items():
        assert rows.tobytes() == fast.topics[name].tobytes(), name
print("flown")
"""


def patched(tree):
    """Copy the sources to ``tree``, put the example's files into their places and apply its patch."""
    shutil.copytree(ROOT / "src", tree / "src", ignore=shutil.ignore_patterns("__pycache__", "*.egg-info", "test"))
    shutil.copytree(EXAMPLE / "quad_torque_filter", tree / "src" / "quad_torque_filter")
    shutil.copy2(EXAMPLE / "TorqueFilterInternals.msg", tree / "src" / "quad_msgs" / "msg")
    subprocess.run(["git", "apply", str(EXAMPLE / "stage.patch")], cwd=tree, check=True, timeout=60)
    metadata = tree / "site" / "quad_torque_filter-0.2.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: quad_torque_filter\nVersion: 0.2.0\n", "utf-8")
    points = "[quad.torque_filter]\nlow_pass = quad_torque_filter.low_pass\n"
    (metadata / "entry_points.txt").write_text(points, "utf-8")
    paths = [*map(str, (tree / "src").iterdir()), str(tree / "site"), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "QUAD_CACHE_DIR": str(tree / "cache")}


def test_two_places_are_edited():
    assert (EXAMPLE / "stage.patch").read_text(encoding="utf-8").count("\n@@ ") == 2


@pytest.mark.parametrize("engine", ["plain", pytest.param("compiled", marks=pytest.mark.long)])
def test_it_flies_without_ros(tmp_path, engine):
    environment = patched(tmp_path)
    command = [sys.executable, "-c", FLY, engine]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "flown\n"
