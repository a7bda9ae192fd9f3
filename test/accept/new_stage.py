"""A stage of one's own (examples/torque_filter) in a clone: built, flown over ROS, in the bag, replayed, same bits."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from figures import Figures
from flying import ROOT

EXAMPLE = ROOT / "examples" / "torque_filter"
FLIGHT = ("hover", "--duration", "2", "--seed", "5", "--set", "torque_filter.low_pass.time_constant=0.006")
COMPARE = """
import sys
from pathlib import Path
from quad_core.cascade import COMMAND, COMMANDING, SIGNALS
from quad_flight import flight
from quad_flight_log.bag.reader import open_flight
from test_same_bits import assert_same
assert (COMMAND, COMMANDING) == ("wrench_filtered", "torque_filter")
bag = open_flight(Path(sys.argv[1]))
assert {COMMAND, "torque_filter/internals"} <= {topic for topic in SIGNALS if bag.has(topic)}
settings = ["torque_filter.low_pass.time_constant=0.006"]
described = flight.from_names("hover", duration=2.0, seed=5, settings=settings)
assert_same(bag, flight.fly(described, compiled=sys.argv[2] == "compiled"))
"""


def prepared(clone):
    """Clone the repository and put the example's files into their places."""
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    shutil.copytree(EXAMPLE / "quad_torque_filter", clone / "src" / "quad_torque_filter")
    shutil.copy2(EXAMPLE / "TorqueFilterInternals.msg", clone / "src" / "quad_msgs" / "msg")
    subprocess.run(["git", "apply", str(EXAMPLE / "stage.patch")], cwd=clone, check=True)


def main():
    figures = Figures()
    keep = ("HOME", "PATH", "USER", "LANG", "PYTHON", "PIP_CACHE_DIR", "PIP_CONFIG_FILE", "PIP_INDEX_URL")
    path = os.pathsep.join(part for part in os.environ["PATH"].split(os.pathsep) if str(ROOT) not in part)
    clean = {**{name: os.environ[name] for name in keep if name in os.environ}, "PATH": path}
    with tempfile.TemporaryDirectory(prefix="new-stage-") as folder:
        clone, bag = Path(folder, "clone"), Path(folder, "bag")
        prepared(clone)
        inside = 'source scripts/env.sh && exec env PYTHONPATH="test:$PYTHONPATH" python -c "$@"'
        commands = {
            "scripts/setup": ["scripts/setup"],
            "flight over ROS": ["scripts/fly", *FLIGHT, "--out", str(bag)],
            "bag": ["scripts/log", "verify", str(bag)],
            "replay": ["scripts/log", "replay", str(bag)],
            "bits of the flight without ROS": ["bash", "-c", inside, "-", COMPARE, str(bag), "plain"],
            "bits of the compiled flight": ["bash", "-c", inside, "-", COMPARE, str(bag), "compiled"],
        }
        for name, command in commands.items():
            done = subprocess.run(command, cwd=clone, env=clean, capture_output=True, text=True, check=False)
            figures.check(done.returncode == 0, f"{name}: exit code {done.returncode}")
            if done.returncode:
                print(done.stdout[-2000:] + done.stderr[-2000:])
                break
    return figures.code()
