"""Compiled by Numba the guard gives the same bits."""

import random

import pytest
from guard_cases import Owner, flying

from quad_core.compilation import compiled
from quad_core.enumerations import GuardMode
from quad_core.types import Vec3, Wrench
from quad_guard import guard
from quad_guard.checks import StateSample, WrenchCommand


def random_inputs(rng, step, period):
    wrench = Wrench(rng.uniform(0.0, 20.0), Vec3(*(rng.uniform(-3.0, 3.0) for _ in range(3))))
    x = step * period / 1e9 + (3.0 if rng.random() < 0.02 else 0.0)
    state = flying(rng.uniform(0.0, 9.0), x, rng.uniform(-1.0, 1.0), [rng.uniform(-3.0, 3.0) for _ in range(3)])
    late = step - (rng.randrange(20) if rng.random() < 0.2 else 0)
    return guard.Inputs(
        step,
        period,
        WrenchCommand(wrench, late, rng.random() < 0.7),
        StateSample(state, step, rng.random() < 0.8),
        rng.choice([0, 0, 0, 0, 0, 1, 2]) if step % 400 else 0,
    )


def test_every_bit_is_the_same_compiled():
    pytest.importorskip("numba")
    fast = compiled(guard.step)
    rng = random.Random(11)
    modes = set()
    for _ in range(6):
        owner = Owner()
        memory = twin = owner.memory
        for step in range(600):
            inputs = random_inputs(rng, step, owner.period)
            wrench, memory, report = guard.step(owner.parameters, owner.vehicle, memory, inputs, owner.dt)
            found, twin, seen = fast(owner.parameters, owner.vehicle, twin, inputs, owner.dt)
            assert (found, twin, seen) == (wrench, memory, report)
            modes.add(report.status.mode)
    assert modes >= {GuardMode.PASS, GuardMode.DESCEND}
