"""A row of a campaign: what counts as a success."""

import pytest

from quad_campaign.batch import row
from quad_campaign.definition import Definition
from quad_flight.flight import Result
from quad_flight.score import Score

LIMITED = Definition("limits", "", {}, {}, {"largest_error": 0.2, "last_error": 0.1}, 1)


def result(outcome="ended", *, largest=0.2, last=0.1):
    return Result(outcome, 5, 10, 0.0, Score(5, 0.2, largest, last, 3.0), {})


@pytest.mark.parametrize(
    ("flown", "good"),
    [
        (result(), True),
        (result(largest=0.21), False),
        (result(last=0.11), False),
        (result("diverged"), False),
        (result("taken over"), False),
    ],
)
def test_a_success_ended_within_every_limit(flown, good):
    assert row(LIMITED, 7, {"vehicle.mass": 0.5}, flown)["success"] is good
