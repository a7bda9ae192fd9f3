"""A package that is not ours adds a position law by entry point; installed by pip it flies by name over ROS."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from flying import ROOT

from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight


def test_a_law_that_pip_installed_flies_by_name_over_ros(tmp_path):
    shutil.copytree(ROOT / "examples" / "my_law", tmp_path / "my_law")  # pip builds in the folder
    options = ["--quiet", "--no-index", "--no-deps", "--no-build-isolation", "--target", str(tmp_path / "site")]
    command = [sys.executable, "-m", "pip", "install", *options, str(tmp_path / "my_law")]
    subprocess.run(command, check=True, timeout=120, capture_output=True)
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path / 'site'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    softer = [f"position_controller.my_law.{gain}=1.5" for gain in ("stiffness", "damping")]
    words = ["--position", "my_law", "--duration", "1", "--limits", "position_rmse=2", "--out", str(tmp_path / "bag")]
    words += [word for setting in softer for word in ("--set", setting)]
    command = [str(ROOT / "scripts" / "fly"), "hover", *words]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=240, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    flight = open_flight(tmp_path / "bag")
    assert any("my_law.stiffness: 1.5" in text for text in flight.array("flight/parameters")["parameters"])
    internals = flight.array("position_controller/internals")
    assert np.linalg.norm(internals["position_error"], axis=1).max() > 0.05
    assert [list(extra) for extra in internals["extra"][:3]] == [[0.0], [1.0], [2.0]]
