"""Which answers of a stage are refused in one plant step, and which inputs a stage may take."""

import math
from typing import NamedTuple

import pytest

from quad_core.cascade import ATTITUDE, POSITION, STAGES
from quad_core.roles import Input
from quad_core.types import Actuation, AttitudeThrust, TrajectoryPoint, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_flight import stages
from quad_flight.loop import Schedule, Setup
from quad_flight.stages import PerStage, Signals

STATE = VehicleState(p_w=Vec3(1.0, 2.0, 3.0))
REFERENCE = TrajectoryPoint(0.25)
ACTUATION = Actuation(thrust=7.0)
SIGNALS = Signals(attitude_setpoint=AttitudeThrust(thrust=1.0), wrench_setpoint=Wrench(2.0))
MEMORY = PerStage(position_controller=("before",), attitude_controller=("before",))
INTERNALS = PerStage(position_controller="seen before", attitude_controller="seen before")


class Memory(NamedTuple):
    """What a stand-in remembers."""

    number: float = 0.0


class Law:
    """Records its calls and gives prepared answers."""

    Memory = Memory

    def __init__(self, output, number=0.0):
        self.calls = []

        def step(parameters, vehicle, memory, inputs, dt):
            self.calls.append((parameters, vehicle, memory, inputs, dt))
            return output, Memory(number), "seen now"

        self.step = step


def asked(k, position, attitude, steps=(10, 2)):
    schedule = Schedule(2_000_000, 5, PerStage(*steps), 0.0)
    own = PerStage(position_controller="of position", attitude_controller="of attitude")
    setup = Setup(Vehicle(), schedule, None, None, None, None, own, None)
    answer = stages.answer_of(PerStage(position_controller=position, attitude_controller=attitude))
    return answer(setup, MEMORY, SIGNALS, INTERNALS, STATE, REFERENCE, ACTUATION, k)


@pytest.mark.parametrize(
    ("wrong", "remembered"),
    [
        (AttitudeThrust(thrust=math.nan), 0.0),
        (AttitudeThrust(angles=Vec3(0.0, 0.0, math.inf)), 0.0),
        (AttitudeThrust(), math.inf),
        (AttitudeThrust(), math.nan),
    ],
)
def test_a_first_stage_that_is_refused_ends_the_step(wrong, remembered):
    attitude = Law(Wrench(4.0))
    assert asked(0, Law(wrong, remembered), attitude)[3] == 1
    assert attitude.calls == []


@pytest.mark.parametrize(("wrong", "remembered"), [(Wrench(math.inf), 0.0), (Wrench(), -math.inf)])
def test_a_second_stage_that_is_refused_is_named(wrong, remembered):
    assert asked(0, Law(AttitudeThrust()), Law(wrong, remembered))[3] == 2


def test_large_finite_numbers_are_not_refused():
    assert asked(0, Law(AttitudeThrust(angles=Vec3(1e308, 1e308, 1e308)), 1e308), Law(Wrench(-1e308)))[3] == 0


def rows(position=(), attitude=()):
    first, second = STAGES
    return [first._replace(takes=tuple(position)), second._replace(takes=tuple(attitude))]


def test_a_stage_may_take_its_own_or_a_later_output_of_the_step_before():
    table = rows([Input("wrench_setpoint", lag=1)], [Input("wrench_setpoint", lag=1)])
    # behind state, reference, actuation and the position law's output of the step before
    assert [stages.places(table, number) for number in (1, 2)] == [(0, 4), (0, 4)]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (rows([Input("wrench_setpoint")]), f"{POSITION}: found wrench_setpoint with lag 0"),
        (rows([], [Input("wrench_setpoint")]), f"{ATTITUDE}: found wrench_setpoint with lag 0"),
        (rows([Input("actuation")]), f"{POSITION}: found actuation with lag 0"),
        (rows([], [Input("reference", lag=1)]), f"{ATTITUDE}: found reference with lag 1"),
        (rows([], [Input("truth")]), f"{ATTITUDE}: found truth"),
        (rows([], [Input("actuation", lag=2)]), f"{ATTITUDE}: found actuation with lag 2"),
    ],
)
def test_an_input_that_is_not_there_in_time_is_refused(table, message):
    with pytest.raises(ValueError, match=message):
        for number in (1, 2):
            stages.places(table, number)
