"""The compiled position law gives the bits of the interpreted one, memory carried along, in all presets."""

import random

import pytest
from position_cases import DT, PRESETS, VEHICLE, bits, random_inputs

from quad_core.compilation import compiled
from quad_position_ctrl import aibs

pytest.importorskip("numba")

STEPS = 10_000


@pytest.mark.parametrize("preset", PRESETS)
def test_ten_thousand_random_steps_are_bit_equal(preset):
    parameters = PRESETS[preset]
    step = compiled(aibs.step)
    rng = random.Random(38)
    start = aibs.init(parameters, VEHICLE)
    assert bits(compiled(aibs.init)(parameters, VEHICLE)) == bits(start)
    here = there = start
    frozen = bounded = 0
    for k in range(STEPS):
        inputs = random_inputs(rng)
        setpoint, here, internals = aibs.step(parameters, VEHICLE, here, inputs, DT)
        other, there, seen = step(parameters, VEHICLE, there, inputs, DT)
        assert bits((setpoint, here, internals)) == bits((other, there, seen)), k
        frozen += internals.adaptation_frozen
        bounded += internals.velocity_limited
        if k % 250 == 249:
            here = there = start
    if preset == "printed":
        # only corrections above 1e6 m/s are out of reach
        assert (frozen, bounded) == (0, 0)
    else:
        assert STEPS / 10 < bounded <= frozen < STEPS
