"""The guard over a whole Case 2: unseen while all is good, in command at once when the controller falls silent."""

import math
import random

import pytest

from quad_attitude_ctrl import abfnitsm
from quad_core.guard_parameters import GuardParameters
from quad_core.parameters import build
from quad_core.types import CALM, AttitudeInputs, PositionInputs
from quad_core.vehicle import Vehicle
from quad_dynamics import rigid_body
from quad_dynamics.rotors import allocate_within, rotor_limit
from quad_guard import guard
from quad_guard.checks import StateSample, WrenchCommand
from quad_position_ctrl import aibs
from quad_trajectory import case2

pytestmark = pytest.mark.unit

PERIOD, DT = 2_000_000, 0.002
VEHICLE = Vehicle()
GUARD = GuardParameters()
POSITION = build(aibs.Parameters, aibs.PRESETS["tuned"])
ATTITUDE = build(abfnitsm.Parameters, abfnitsm.PRESETS["tuned"])
PLANT = rigid_body.Parameters()
MOMENTS = sorted(random.Random(3).sample(range(3000, 12000), 6))
SILENT = WrenchCommand(arrived=False)


def guarded(memory, step, command, state):
    sample = StateSample(state, step, step * PERIOD, True, True)
    return guard.step(GUARD, VEHICLE, memory, guard.Inputs(step, PERIOD, command, sample, guard.NO_REQUEST), DT)


@pytest.fixture(scope="module")
def moments():
    """Fly Case 2 under the guard and return {step: (plant, guard memory)} at the chosen moments."""
    plant = rigid_body.init(PLANT, VEHICLE)
    path = case2.plan(case2.Parameters(), VEHICLE, rigid_body.observe(PLANT, VEHICLE, plant))
    position, attitude = aibs.init(POSITION, VEHICLE), abfnitsm.init(ATTITUDE, VEHICLE)
    memory = guard.init(GUARD, VEHICLE)
    actuation = allocate_within(VEHICLE, abfnitsm.Wrench(), rotor_limit(VEHICLE))
    found = {}
    for k in range(MOMENTS[-1] + 1):
        state = rigid_body.observe(PLANT, VEHICLE, plant)
        if k in MOMENTS:
            found[k] = (plant, memory)
        if k % 5 == 0:
            reference = case2.sample(case2.Parameters(), path, k * DT)
            setpoint, position, _ = aibs.step(
                POSITION, VEHICLE, position, PositionInputs(state, reference, actuation), 5 * DT
            )
        wrench, attitude, _ = abfnitsm.step(ATTITUDE, VEHICLE, attitude, AttitudeInputs(state, setpoint, actuation), DT)
        flown, memory, report = guarded(memory, k, WrenchCommand(wrench, k, k * PERIOD, True, True), state)
        assert flown is wrench
        assert (report.mode, report.condition, report.warning, report.refused_commands) == (0, 0, False, 0)
        plant, actuation = rigid_body.step(PLANT, VEHICLE, plant, flown, CALM, DT)
    return found


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_controller_lost_in_case_2_is_replaced_and_the_vehicle_lands(moments, moment):
    plant, memory = moments[moment]
    took_over = None
    assert rigid_body.observe(PLANT, VEHICLE, plant).p_w.z > 0.5
    for k in range(moment, moment + 40_000):
        state = rigid_body.observe(PLANT, VEHICLE, plant)
        if state.p_w.z <= 0.1:
            break
        flown, memory, report = guarded(memory, k, SILENT, state)
        if took_over is None and report.mode == guard.DESCEND:
            took_over = k
        plant, _ = rigid_body.step(PLANT, VEHICLE, plant, flown, CALM, DT)
    # the last good wrench was that of the step before the moment
    assert (took_over - (moment - 1)) * DT <= 0.05 + DT + 1e-12
    assert math.sqrt(sum(part * part for part in state.v_w)) < 1.5
    assert math.acos(1.0 - 2.0 * (state.q_wb.x**2 + state.q_wb.y**2)) < math.radians(15.0)
