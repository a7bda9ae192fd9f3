"""Which parameters may vary between flights: none that decides which code runs, and to nothing that fly refuses."""

import pytest

from quad_core.parameters import ParameterError
from quad_flight.flight import from_names
from quad_flight.variation import Variation


def test_what_decides_which_code_runs_cannot_vary():
    base = from_names("hover", settings=["simulator.sensor.delay=0.02"])
    flight = Variation(base, ["position_controller.prediction.max_age"]).apply(
        {"position_controller.prediction.max_age": 0.03}
    )
    assert flight.setup.stages.position_controller.prediction.max_age == 0.03
    for name in ("position_controller.prediction.enabled", "position_controller.law", "simulator.plant"):
        with pytest.raises(ParameterError, match=name):
            Variation(base, [name])


def test_an_inertia_that_no_body_has_is_refused():
    base = from_names("hover")
    with pytest.raises(ParameterError, match="inertia"):
        Variation(base, ["vehicle.inertia_zz"]).apply({"vehicle.inertia_zz": 1.0})


def test_a_text_that_its_plugin_cannot_read_is_refused():
    name = "trajectory.waypoints.points"
    variation = Variation(from_names("waypoints"), [name])
    with pytest.raises(ParameterError, match=r"waypoint 2 .*'4 0'"):
        variation.apply({name: "0 0 2; 4 0"})
    assert variation.apply({name: "0 0 2; 4 0 2"}).setup.trajectory.points == "0 0 2; 4 0 2"
