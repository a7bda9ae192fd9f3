"""The compiled attitude law gives the bits of the interpreted one, memory carried along, in all presets."""

import random

import pytest
from attitude_cases import DT, PRESETS, VEHICLE, bits, random_inputs

from quad_attitude_ctrl import abfnitsm
from quad_attitude_ctrl.command import CommandSource
from quad_attitude_ctrl.sliding_control import AdaptationForm
from quad_core.compilation import compiled

pytest.importorskip("numba")

STEPS = 10_000


@pytest.mark.parametrize("preset", PRESETS)
def test_ten_thousand_random_steps_are_bit_equal(preset):
    parameters = PRESETS[preset]
    step = compiled(abfnitsm.step)
    rng = random.Random(46)
    start = abfnitsm.init(parameters, VEHICLE)
    assert bits(compiled(abfnitsm.init)(parameters, VEHICLE)) == bits(start)
    here = there = start
    frozen = limited = 0
    for k in range(STEPS):
        inputs = random_inputs(rng)
        wrench, here, internals = abfnitsm.step(parameters, VEHICLE, here, inputs, DT)
        other, there, seen = step(parameters, VEHICLE, there, inputs, DT)
        assert bits((wrench, here, internals)) == bits((other, there, seen)), k
        frozen += any(internals.adaptation_frozen)
        limited += any(internals.torque_limited)
        if k % 250 == 249:
            here = there = start
    assert frozen > STEPS / 100
    if parameters.roll.max_torque < 1.0:
        assert STEPS / 10 < limited <= frozen < STEPS
    else:
        # their torque limit of 1e6 N m is out of reach but for the wildest tumbling
        assert limited < STEPS / 100


def test_other_forms_are_bit_equal():
    """What no preset takes: fed-forward and raw commands, the form ``sat`` of Eq. 54, a narrow layer of Eq. 53."""
    step = compiled(abfnitsm.step)
    rng = random.Random(54)
    narrow = PRESETS["minimal"].roll._replace(reaching_width=1e-3, dead_zone=0.0)
    for command in (CommandSource.FEED_FORWARD.value, CommandSource.RAW.value):
        form = AdaptationForm.SAT.value
        parameters = PRESETS["minimal"]._replace(command=command, adaptation_form=form, roll=narrow, pitch=narrow)
        here = there = abfnitsm.init(parameters, VEHICLE)
        for k in range(1000):
            inputs = random_inputs(rng)
            answer = abfnitsm.step(parameters, VEHICLE, here, inputs, DT)
            other = step(parameters, VEHICLE, there, inputs, DT)
            assert bits(answer) == bits(other), k
            here, there = answer[1], other[1]
