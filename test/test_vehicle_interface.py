"""A vehicle interface of a user: a package of its own, flown over ROS, recorded and replayed."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from flying import FLY, PATIENT, ROOT
from scratch_workspace import built, changed_files

from quad_flight_log.reader import open_flight

pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

EXAMPLE = ROOT / "examples" / "my_vehicle_interface"


def test_it_flies_is_recorded_and_replayed_and_no_file_here_changes(tmp_path):
    before = changed_files()
    environment = built(tmp_path / "workspace", "my_vehicle_interface")
    bag = tmp_path / "bag"
    owner = ("--realtime", "--vehicle-interface", f"my_vehicle={EXAMPLE / 'my_vehicle.yaml'}", *PATIENT[2:])
    for command in (
        [str(FLY), "hover", "--duration", "2", *owner, "--limits", "position_rmse=0.2", "--out", str(bag)],
        [sys.executable, "-m", "quad_report.cli", "check", str(bag)],
        [sys.executable, "-m", "quad_report.cli", "replay", str(bag)],
    ):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    flown = open_flight(Path(bag))
    state, actuation = flown.array("state"), flown.array("actuation")
    assert list(np.diff(state["step"].astype(int))) == [1] * (len(state) - 1)
    assert len(actuation) == len(state)
    assert np.linalg.norm(state["p_w"][-1] - flown.array("reference")["p_w"][-1]) < 0.2
    assert changed_files() == before
