"""Overshoot at corners and yaw steps, on curves whose overshoot is known."""

import math

import numpy as np
import pytest

from quad_flight_log.analysis.metrics import METRICS, FlightMetrics
from quad_flight_log.analysis.overshoot import corner_overshoot, yaw_overshoot

TIMES = np.arange(0.0, 20.0, 0.01)


def square_corner():
    """Along +x at 0.5 m/s until t = 10 s, then along +y."""
    turned = TIMES >= 10.0
    desired = np.stack(
        [np.minimum(TIMES, 10.0) * 0.5, np.maximum(TIMES - 10.0, 0.0) * 0.5, np.full_like(TIMES, 3.0)], 1
    )
    velocity = np.where(turned[:, None], [0.0, 0.5, 0.0], [0.5, 0.0, 0.0])
    return desired, velocity


def test_what_goes_beyond_a_corner_along_the_arrival_counts():
    desired, velocity = square_corner()
    flown = desired.copy()
    after = TIMES - 10.0
    flown[:, 0] += np.where(after > 0.0, 0.2 * np.exp(-((after - 1.0) ** 2)), 0.0)
    assert corner_overshoot(TIMES, flown, desired, velocity) == pytest.approx(0.2, abs=1e-6)
    flown[:, 1] += 0.7  # sideways is no overshoot
    assert corner_overshoot(TIMES, flown, desired, velocity) == pytest.approx(0.2, abs=1e-6)


def test_nothing_beyond_is_zero_and_late_is_not_counted():
    desired, velocity = square_corner()
    short = desired - [0.1, 0.0, 0.0]
    assert corner_overshoot(TIMES, short, desired, velocity) == 0.0
    short[TIMES > 15.5, 0] += 1.0
    assert corner_overshoot(TIMES, short, desired, velocity) == 0.0


def test_a_reference_without_corner_or_step_has_no_overshoot():
    angle = 0.5 * TIMES
    circle = np.stack([np.cos(angle), np.sin(angle), TIMES], 1)
    velocity = np.stack([-0.5 * np.sin(angle), 0.5 * np.cos(angle), np.ones_like(TIMES)], 1)
    assert corner_overshoot(TIMES, circle + 0.1, circle, velocity) is None
    assert yaw_overshoot(TIMES, np.zeros_like(TIMES), np.zeros_like(TIMES)) is None


@pytest.mark.parametrize("turn", [0.0, math.pi])
def test_yaw_beyond_its_step(turn):
    """A step from pi/3 to 0 (or across pi) with an overshoot of 0.05 rad; what is before the step does not count."""
    desired = np.where(TIMES < 10.0, math.pi / 3.0, 0.0) + turn
    after = TIMES - 10.0
    yaw = np.where(after < 0.0, desired + 0.4, turn + (math.pi / 3.0) * np.exp(-8.0 * np.maximum(after, 0.0)))
    yaw = yaw - np.where(after > 0.0, 0.05 * np.exp(-8.0 * (after - 2.0) ** 2), 0.0)
    wrapped = (yaw + math.pi) % (2.0 * math.pi) - math.pi
    assert yaw_overshoot(TIMES, wrapped, desired) == pytest.approx(0.05, abs=1e-4)


def test_every_metric_has_a_value_and_a_meaning():
    assert set(METRICS) == set(FlightMetrics._fields)


def test_the_farthest_of_all_corners_counts():
    desired = np.stack([np.clip(TIMES, 0.0, 5.0), np.clip(TIMES - 5.0, 0.0, 5.0), np.clip(TIMES - 10.0, 0.0, 9.0)], 1)
    steps = [TIMES < 5.0, (TIMES >= 5.0) & (TIMES < 10.0), TIMES >= 10.0]
    velocity = np.stack(steps, 1).astype(float)
    flown = desired.copy()
    flown[(TIMES > 5.5) & (TIMES < 6.0), 0] += 0.3
    flown[(TIMES > 10.5) & (TIMES < 11.0), 1] += 0.1
    assert corner_overshoot(TIMES, flown, desired, velocity) == pytest.approx(0.3)


def test_the_way_after_the_next_corner_is_not_beyond_this_one():
    """Along x, for 2 s along y, along x again: what is flown there is beyond the first corner, and meant to be."""
    along_y = (TIMES >= 10.0) & (TIMES < 12.0)
    velocity = np.where(along_y[:, None], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    desired = np.stack(
        [np.minimum(TIMES, 10.0) + np.maximum(TIMES - 12.0, 0.0), np.clip(TIMES - 10.0, 0.0, 2.0), 0.0 * TIMES], 1
    )
    assert corner_overshoot(TIMES, desired, desired, velocity) == 0.0


def test_yaw_steps_and_overshoots_across_half_a_turn():
    after = TIMES >= 10.0
    across = np.where(after, -3.0, 3.0)  # 0.283 rad onwards
    flown = np.where(after & (TIMES < 11.0), -2.95, across)
    assert yaw_overshoot(TIMES, flown, across) == pytest.approx(0.05)
    before = np.where(after, 3.1, 2.8)
    beyond = np.where(after & (TIMES < 11.0), 3.2 - 2.0 * math.pi, before)
    assert yaw_overshoot(TIMES, beyond, before) == pytest.approx(0.1)


def test_who_is_still_on_the_way_to_a_large_step_is_not_beyond_it():
    desired = np.where(TIMES >= 10.0, 3.0, 0.0)
    late = np.where(TIMES < 11.0, -0.3, desired)
    assert yaw_overshoot(TIMES, late, desired) == 0.0
