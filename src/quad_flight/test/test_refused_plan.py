"""A flight whose plan is refused is one clear result, in a sweep and in a campaign too, and no error."""

import math

import pytest

from quad_campaign.batch import row
from quad_campaign.definition import Definition
from quad_core import plugins
from quad_flight.flight import flight_from_parameters, fly

pytestmark = pytest.mark.skipif(
    not plugins.names(plugins.PLANT), reason="plug-ins are not installed: run scripts/setup"
)


@pytest.fixture
def flight():
    return flight_from_parameters({"trajectory": {"trajectory": "waypoints", "waypoints.thrust": 0.3}})


def test_a_plan_that_cannot_be_flown_is_a_refused_flight_with_its_reason(flight):
    result = fly(flight)
    assert (result.outcome, result.steps, result.end_step, result.topics) == ("refused", 0, 0, {})
    assert "waypoints.thrust" in result.reason
    assert "weight" in result.reason
    assert math.isnan(result.rmse)


def test_a_campaign_notes_it_in_the_row_of_the_flight(flight):
    fields = dict.fromkeys(Definition._fields)
    definition = Definition(**{**fields, "success": {"rmse": 0.1}})
    found = row(definition, 7, {"x": 1.0}, fly(flight))
    assert (found["flight"], found["outcome"], found["steps"], found["success"]) == (7, "refused", 0, False)
    assert "weight" in found["reason"]
