"""A vehicle on MuJoCo's ground: it rests on its feet, stays put under friction and leaves with thrust."""

import math

import pytest

from quad_core.geometry import norm
from quad_core.parameters import build
from quad_core.types import Conditions, Vec3, Wrench
from quad_core.vehicle import Layout, Vehicle
from quad_mujoco import plant

STEP = 4e-3
VEHICLE = Vehicle(layout=Layout.X)
DEPTH = 0.1
CALM = Vec3()
WEIGHT = VEHICLE.mass * VEHICLE.gravity


def flown(wrench, seconds, state=None, force=CALM, **given):
    """Return the plant's state ``seconds`` later."""
    parameters = build(plant.Parameters, {"ground.enabled": True, "ground.foot_depth": DEPTH, **given})
    state = plant.init(parameters, VEHICLE) if state is None else state
    for _ in range(round(seconds / STEP)):
        state, _ = plant.step(parameters, VEHICLE, state, wrench, Conditions(force_w=force), STEP)
    return state


@pytest.mark.parametrize("height", [DEPTH, 0.3])
def test_it_comes_to_rest_on_its_feet(height):
    motion = flown(Wrench(), 2.0, **{"initial.p.z": height}).motion
    assert motion.p_w.z == pytest.approx(DEPTH, abs=3e-3)
    assert norm(motion.v_w) < 1e-3
    assert norm(motion.omega_b) < 1e-3
    assert 1.0 - abs(motion.q_wb.w) < 1e-6


def test_the_ground_lies_where_it_is_said_to_lie():
    motion = flown(Wrench(), 2.0, **{"initial.p.z": 5.2, "ground.height": 5.0}).motion
    assert motion.p_w.z == pytest.approx(5.0 + DEPTH, abs=3e-3)


def test_friction_is_a_share_of_what_weighs_on_the_feet():
    landed = flown(Wrench(), 1.0, **{"initial.p.z": DEPTH})
    stays = flown(Wrench(), 1.0, landed, Vec3(0.5 * WEIGHT, 0.0, 0.0), **{"ground.friction": 0.8})
    slides = flown(Wrench(), 1.0, landed, Vec3(0.5 * WEIGHT, 0.0, 0.0), **{"ground.friction": 0.1})
    assert abs(stays.motion.p_w.x) < 0.02
    assert slides.motion.p_w.x > 0.5


def test_it_leaves_the_ground_with_more_thrust_than_its_weight():
    landed = flown(Wrench(), 1.0, **{"initial.p.z": DEPTH})
    free = flown(Wrench(1.2 * WEIGHT), 1.0, landed)
    assert free.motion.p_w.z == pytest.approx(DEPTH + 0.5 * 0.2 * VEHICLE.gravity, abs=0.05)
    assert math.hypot(free.motion.p_w.x, free.motion.p_w.y) < 1e-3
