"""A flight described in a few words is the flight described to the nodes."""

import math

import pytest
from paper_flight import PaperCase, arrival, paper_flight, worst_rmse

from quad_core.parameters import ParameterError
from quad_flight.flight import flight_from_parameters

pytestmark = pytest.mark.unit


def test_words_reach_the_nodes_they_are_meant_for():
    paper_case = PaperCase(
        "case2",
        "minimal",
        "printed",
        {"x.position_gain": 3.0},
        {"yaw.power": 1.5},
        {"acceleration_sd": 1.5},
        {"thrust_to_weight": 2.0},
        (1.0, 2.0, 3.0),
        7.0,
    )
    spelt = flight_from_parameters(
        {
            "/**": {"vehicle.thrust_to_weight": 2.0},
            "simulator": {
                "guard.enabled": False,
                "held_gaussian.acceleration_sd": 1.5,
                "rigid_body.initial.p.x": 1.0,
                "rigid_body.initial.p.y": 2.0,
                "rigid_body.initial.p.z": 3.0,
            },
            "trajectory": {"trajectory": "case2", "case2.start": "printed", "case2.duration": 7.0},
            "position_controller": {"preset": "minimal", "aibs.x.position_gain": 3.0},
            "attitude_controller": {"preset": "minimal", "abfnitsm.yaw.power": 1.5},
        },
        4.0,
    )
    assert paper_flight(paper_case, 4.0).setup == spelt.setup


def test_a_misspelt_word_is_refused():
    with pytest.raises(ParameterError, match=r"aibs\.x\.position_gian"):
        paper_flight(PaperCase("case1", position={"x.position_gian": 3.0}))


def test_arrival_of_a_flight_beside_the_reference():
    """Off by 1 m beside the first point and no disturbance: still closing in after 0.5 s, there after 3 s."""
    calm = {"acceleration_sd": 0.0, "angular_sd": 0.0}
    paper_case = PaperCase("case1", start="printed", disturbance=calm, initial=(5.0, 6.0, 11.0), duration=4.0)
    early, late = (arrival(paper_case, [1], after, compiled=False) for after in (0.5, 3.0))
    assert (early.seeds, early.ended) == (1, 1)
    assert 0.1 < early.error_then < 1.1
    assert early.largest_after >= 0.95 * early.error_then
    assert late.error_then < 0.01
    assert early.largest_after > late.largest_after >= late.rmse_after > 0.0
    assert early.rmse_after > late.rmse_after


def test_a_flight_that_diverges_counts_as_such():
    """As printed from the origin, with thrust as good as without limit; `as_printed.md` shows what happens."""
    paper_case = PaperCase("case1", "printed", "printed", vehicle={"thrust_to_weight": 20.0}, duration=9.0)
    found = arrival(paper_case, [1], 8.5, compiled=False)
    assert (found.seeds, found.ended) == (1, 0)
    assert math.isnan(found.error_then)
    assert math.isnan(found.largest_after)
    assert worst_rmse(paper_case, [1], compiled=False) == math.inf
