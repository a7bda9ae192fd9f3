"""What a stranger says on a node's topics: refused, and what the flight says afterwards still counts."""

import time

import pytest
from echo_responder import PERIOD, echoes


@pytest.fixture
def make(monkeypatch):
    """Return a function that makes the node with the given ROS parameters."""
    yield from echoes(monkeypatch)


@pytest.mark.parametrize("mode", ["realtime", "lockstep"])
def test_a_state_that_a_stranger_sent_does_not_make_the_later_ones_old(make, mode):
    node = make("period_steps:=5", f"flight.mode:={mode}")
    node.reference(0, 2**64 - 1)
    node.actuation(4)
    node.state(0)
    node.state(200, stamp=PERIOD)
    time.sleep(0.05)
    node.state(4)
    node.state(5)
    assert node.steps()[-1] == 5
