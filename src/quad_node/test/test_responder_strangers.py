"""What a stranger says on a node's topics: refused, and what the flight says afterwards still counts."""

import math
import time

import pytest
from echo_responder import echoes


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
    node.state(200)
    time.sleep(0.05)
    node.state(4)
    node.state(5)
    assert node.steps()[-1] == 5


@pytest.mark.parametrize("number", [1e13, -1e300, math.nan, math.inf])
def test_an_absurd_input_is_refused_and_the_law_does_not_see_it(make, number):
    node = make("period_steps:=1", "flight.mode:=realtime")
    node.reference(0, 1, x=1.0)
    node.reference(0, 1, x=number)
    node.state(0)
    assert node.counters["rejected"] == 1
    assert [values[0].p_w.x for _, values in node.samples] == [1.0]


@pytest.mark.parametrize("mode", ["realtime", "lockstep"])
def test_a_state_with_the_stamp_of_another_time_is_refused(make, mode):
    node = make("period_steps:=1", f"flight.mode:={mode}")
    node.reference(0, 1)
    node.state(0, stamp=(2**31 - 1) * 10**9)  # a trajectory could not say when its plan ends
    assert (node.counters["rejected"], node.counters["rejected_stamp"]) == (1, 1)
    node.state(0)
    assert [(sample.step, sample.stamp_ns) for sample, _ in node.samples] == [(0, 0)]
