"""In real time a figure is followed as closely as in lockstep: each step has the reference of its own step."""

import numpy as np
import pytest
from flying import PATIENT, fly

from quad_flight_log.bag.reader import open_flight

pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]


def test_case_2_is_followed_in_real_time_with_the_reference_of_each_step(tmp_path):
    out = tmp_path / "bag"
    limits = ("--limits", "position_rmse=0.02")  # 0.047 with the reference of the step before, 0.007 in lockstep
    done = fly("case2", "--realtime", "--duration", "8", *limits, *PATIENT, "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = open_flight(out).array("position_controller/internals")
    lag = rows["step"].astype(int) - rows["input_steps"][:, 0].astype(int)
    assert np.mean(lag == 0) > 0.9
