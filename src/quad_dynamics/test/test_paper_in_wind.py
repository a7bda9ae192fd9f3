"""Plant ``paper`` in moving air: drag is that of the velocity through the air, on each world axis."""

import pytest

from quad_core.types import Conditions, Vec3, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics import paper
from quad_dynamics.parameters import PlantParameters

VEHICLE = Vehicle()._replace(mass=2.0, gravity=10.0, drag_coefficient=0.4)
HOVER = Wrench(20.0, Vec3(0.0, 0.0, 0.0))
WIND = Conditions(wind_w=Vec3(5.0, -3.0, 2.0), force_w=Vec3(0.2, 0.4, -0.6))
PUSHED = (1.1, -0.4, 0.1)
"""(0.4 * wind + force) / 2 in m/s^2."""


def test_wind_pushes_along_each_axis():
    state = paper.init(PlantParameters(), VEHICLE)
    after, _ = paper.step(PlantParameters(), VEHICLE, state, HOVER, WIND, 1e-4)
    assert (after.x8, after.x10, after.x12) == pytest.approx([1e-4 * a for a in PUSHED], rel=1e-4)


def test_wind_is_part_of_what_the_nominal_model_misses():
    state = paper.init(PlantParameters(), VEHICLE)
    lumped = paper.lumped(PlantParameters(), VEHICLE, state, HOVER, WIND)
    assert lumped.lumped_acceleration_w == pytest.approx(PUSHED, abs=1e-12)
    assert lumped.lumped_angular_acceleration_b == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_who_drifts_with_the_wind_feels_none():
    state = paper.init(PlantParameters(), VEHICLE)._replace(x8=5.0, x10=-3.0, x12=2.0)
    after, _ = paper.step(PlantParameters(), VEHICLE, state, HOVER, WIND._replace(force_w=Vec3()), 0.1)
    assert (after.x8, after.x10, after.x12) == pytest.approx((5.0, -3.0, 2.0), abs=1e-12)
