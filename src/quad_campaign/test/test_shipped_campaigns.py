"""The campaigns that come with the stack can be flown, and their commands tell the same flights."""

import pytest

from quad_campaign.batch import flight_of, prepared, shipped
from quad_campaign.definition import read_definition, request
from quad_flight.flight import flight_from_resolved
from quad_flight.set_up import resolve_flight


def test_there_are_campaigns():
    assert {"campaign_case2", "campaign_outdoor"} <= set(shipped())


@pytest.mark.parametrize("name", sorted(shipped()))
def test_flights_differ_and_their_commands_say_how(name):
    definition = read_definition(shipped()[name])
    batch = prepared(definition)
    flights = [flight_of(batch, number) for number in range(6)]
    assert len({flight.setup.plant for flight, _ in flights}) == 6
    flight, values = flights[3]
    again = flight_from_resolved(resolve_flight(request(definition, values), {}))
    assert (again.setup, again.seed) == (flight.setup, flight.seed)
