"""The lagged commands are those of a first-order lag behind a delay, to the fraction of a sample."""

import numpy as np
import pytest
from samples import log_of
from simulated import Manoeuvre

from quad_identify.model import lagged
from quad_identify.record import checked, gridded


@pytest.mark.parametrize(("lag", "delay"), [(0.03, 0.0), (0.03, 0.0104), (0.005, 0.0026), (1e-4, 0.012)])
def test_a_step_of_command_comes_late_by_the_delay_and_rises_by_the_lag(lag, delay):
    (grid,) = gridded(checked(log_of(manoeuvre=Manoeuvre(duration=8.0)))[0])
    step = np.zeros_like(grid.command)
    step[4000:] = 1.0
    grid = grid._replace(command=step, per=1, step=grid.fine_step)
    rise = np.clip(np.arange(len(step)) * 1e-3 - 4.0 - delay, 0.0, None)
    expected = 1.0 - np.exp(-rise / lag)
    found = lagged(grid, lag, delay)
    sampled = np.abs(found.mean[:, 0] - expected) < 1e-6
    assert sampled.mean() > 0.999  # but where the step falls on a sample
    area = (1.0 - found.turning_mean[4000:, 0]).sum() * 1e-3
    assert area == pytest.approx(lag + delay + 0.0005, abs=1e-4)  # half a step: the first mean is around a sample
