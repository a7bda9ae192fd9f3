"""A flight whose controllers see only what the odometry relay makes of odom."""

import numpy as np
import pytest
from flying import AT_ONCE, flown

pytestmark = pytest.mark.flight


def test_a_flight_goes_through_the_relay(tmp_path):
    flight = flown("hover", *AT_ONCE, "--duration", "2", "--relay", "--out", tmp_path / "bag")
    assert "odometry_relay" in flight.array("flight/parameters")["role"]
    state, truth = flight.array("state"), flight.array("truth")
    assert len(state) == len(truth) == 1000
    assert np.array_equal(state["stamp_ns"], truth["stamp_ns"])
    assert np.array_equal(state["p_w"], truth["p_w"])
    # twist travels in the body frame: only rounding may differ
    assert np.allclose(state["v_w"], truth["v_w"], rtol=0, atol=1e-12)
    assert not np.array_equal(state["v_w"], truth["v_w"])
