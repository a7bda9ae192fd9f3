"""Laws on predicted states fly over ROS with the bits of the flight without it, and replay to the bit."""

import numpy as np
import pytest
from flying import flown

from quad_flight.flight import fly, from_names
from quad_flight_log.analysis.replay import replay

pytestmark = pytest.mark.flight

CONTROLLERS = ("position_controller", "attitude_controller")
LATE = [
    "simulator.sensor.delay=0.01",
    *(f"{role}.prediction.enabled=true" for role in CONTROLLERS),
    *(f"{role}.prediction.{channel}_age=0.01" for role in CONTROLLERS for channel in ("position", "attitude", "rate")),
    "position_controller.prediction.smoothing=20.0",
]


def test_a_flight_with_prediction_is_the_same_with_and_without_ros(tmp_path):
    settings = [word for setting in LATE for word in ("--set", setting)]
    told = ("case2", "--duration", "1", "--seed", "3", "--limits", "position_max=0.05")
    bag = flown(*told, *settings, "--out", tmp_path / "bag")
    result = fly(from_names("case2", seed=3, duration=1.0, settings=LATE))
    for topic in ("state", "truth", "attitude_setpoint", *(f"{role}/internals" for role in CONTROLLERS)):
        rows, expected = bag.array(topic), result.topics[topic]
        assert len(rows) == len(expected)
        for name in {*rows.dtype.names} & {*expected.dtype.names} - {"next_step"}:
            assert np.array_equal(rows[name], expected[name]), f"{topic}.{name}"
    for role in CONTROLLERS:
        again = replay(bag, role)
        assert again.equal
        ages = again.recorded[f"{role}/internals prediction_ages.x"]
        # what has no age before the first step has 10 ms from the second on, as the vehicle moves
        assert np.median(ages) == pytest.approx(0.01)
