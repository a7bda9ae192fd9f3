"""The disturbance estimate against its transfer function L/(s + L) and numbers by hand."""

import math

import pytest

from quad_core.types import Vec3
from quad_core.vehicle import Vehicle
from quad_position_ctrl.disturbance_observer import ObservedStep, Observer, estimate, next_estimate

DT = 0.01
ZERO = Vec3(0.0, 0.0, 0.0)
UP = Vec3(0.0, 0.0, 1.0)
VEHICLE = Vehicle(mass=2.0, gravity=10.0)


def test_estimate_is_bounded_both_ways():
    assert next_estimate(0.0, 0.0, 100.0, 0.0, 10.0, 5.0, 0.1) == 5.0
    assert next_estimate(0.0, 0.0, -100.0, 0.0, 10.0, 5.0, 0.1) == -5.0


def test_constant_disturbance_is_met_with_the_time_constant():
    """A tilted point mass under a constant d: the estimate is d (1 - exp(-L t)) at every step."""
    observer = Observer(bandwidth=8.0, max_estimate=5.0)
    axis, thrust, d = Vec3(0.6, 0.0, 0.8), 25.0, (0.7, -0.4, 1.1)
    acceleration = (12.5 * 0.6 + d[0], d[1], 12.5 * 0.8 - 10.0 + d[2])
    estimated, velocity = ZERO, Vec3(3.0, -2.0, 1.0)
    for k in range(1, 101):
        now = Vec3(*(v + DT * a for v, a in zip(velocity, acceleration, strict=True)))
        estimated = estimate(observer, VEHICLE, estimated, ObservedStep(velocity, now, axis, axis, thrust), 0.0, DT)
        velocity = now
        share = 1.0 - math.exp(-8.0 * k * DT)
        assert estimated == pytest.approx([share * part for part in d], abs=1e-10)


def test_drag_is_explained_with_the_present_velocity():
    observer = Observer(bandwidth=1e2, max_estimate=5.0)
    now = Vec3(4.0, 0.0, 0.0)
    before = Vec3(4.0 + 0.5 * 4.0 * DT, 0.0, 0.0)
    found = estimate(observer, VEHICLE, ZERO, ObservedStep(before, now, UP, UP, 20.0), -0.5, DT)
    assert found == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_without_bandwidth_nothing_is_estimated():
    off = Observer(bandwidth=0.0, max_estimate=5.0)
    before = Vec3(0.1, 0.2, 0.3)
    step = ObservedStep(ZERO, Vec3(9.0, 9.0, 9.0), UP, UP, 0.0)
    assert estimate(off, VEHICLE, before, step, 0.0, DT) is before
