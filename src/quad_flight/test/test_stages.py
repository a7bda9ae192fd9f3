"""Which answers of a stage are refused in one plant step, and which inputs a stage may take."""

import pytest

from quad_core.cascade import ATTITUDE, POSITION, STAGES
from quad_core.roles import Input
from quad_flight import stages


def rows(position=(), attitude=()):
    first, second = STAGES
    return [first._replace(inputs=tuple(position)), second._replace(inputs=tuple(attitude))]


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
