"""Presets for real conditions: both controllers predict over the age that the head names, and they fly."""

import pytest

from quad_core import plugins
from quad_flight.flight import fly, from_names

pytestmark = pytest.mark.skipif(
    "aibs" not in plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)


@pytest.mark.parametrize(("vehicle", "age"), [("paper", 0.01), ("x500", 0.02)])
def test_a_preset_predicts_in_both_controllers_and_flies(vehicle, age):
    delay = [f"simulator.sensor.delay={age}", "vehicle.rotor_time_constant=0.03"]
    flight = from_names("hover", preset=f"{vehicle}_real", vehicle=vehicle, duration=1.0, settings=delay)
    for role in ("position_controller", "attitude_controller"):
        prediction = flight.resolved[role].node.prediction
        assert prediction.enabled
        assert (prediction.position_age, prediction.attitude_age, prediction.rate_age) == (age, age, age)
    result = fly(flight)
    assert result.outcome == "ended"
    assert result.score.largest_error < 0.05
