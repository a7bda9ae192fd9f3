"""A stage of a user between attitude law and plant: a package of its own, flown without ROS and over it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from scratch_workspace import built, changed_files

ROOT = Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "examples" / "torque_filter"
LOOP = """
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

FLIGHT = ("hover", "--duration", "2", "--seed", "5", "--set", "torque_filter.low_pass.time_constant=0.006")
COMPARE = """
import sys
from pathlib import Path
from quad_core.cascade import COMMAND, COMMANDING, SIGNALS
from quad_flight import flight
from quad_flight_log.reader import open_flight
from test_same_bits import assert_same
assert (COMMAND, COMMANDING) == ("wrench_filtered", "torque_filter")
bag = open_flight(Path(sys.argv[1]))
assert {COMMAND, "torque_filter/internals"} <= {topic for topic in SIGNALS if bag.has(topic)}
settings = ["torque_filter.low_pass.time_constant=0.006"]
assert_same(bag, flight.fly(flight.from_names("hover", duration=2.0, seed=5, settings=settings)))
"""


def installed(folder):
    """Make the example importable from ``folder`` and write the metadata that pip would write of its setup."""
    metadata = folder / "quad_torque_filter-0.1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: quad_torque_filter\nVersion: 0.1.0\n", "utf-8")
    points = "[quad.stages]\ntorque_filter = quad_torque_filter.stage:STAGE\n"
    points += "[quad.torque_filter]\nlow_pass = quad_torque_filter.low_pass\n"
    (metadata / "entry_points.txt").write_text(points, "utf-8")
    paths = [str(EXAMPLE / "quad_torque_filter"), str(folder), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "QUAD_CACHE_DIR": str(folder / "cache")}


@pytest.mark.unit
@pytest.mark.parametrize("engine", ["plain", pytest.param("compiled", marks=pytest.mark.long)])
def test_it_flies_without_ros(tmp_path, engine):
    environment = installed(tmp_path)
    command = [sys.executable, "-c", LOOP, engine]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "flown\n"


@pytest.mark.flight
@pytest.mark.long
def test_it_flies_over_ros_is_recorded_and_replayed_and_no_file_here_changes(tmp_path):
    from flying import FLY  # needs ROS, which the other tests here do not

    before = changed_files()
    environment = built(tmp_path / "workspace", "torque_filter/torque_filter_msgs", "torque_filter/quad_torque_filter")
    bag = tmp_path / "bag"
    for command in (
        [str(FLY), *FLIGHT, "--out", str(bag)],
        [sys.executable, "-m", "quad_report.cli", "check", str(bag)],
        [sys.executable, "-m", "quad_report.cli", "replay", str(bag)],
        [sys.executable, "-c", COMPARE, str(bag)],
    ):
        done = subprocess.run(command, env=environment, cwd=ROOT / "test", capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert changed_files() == before
