"""In real time a step waits for the input of its own, until the next state at the latest."""

import pytest
from echo_responder import echoes


@pytest.fixture
def make(monkeypatch):
    """Return a function that makes the node with the given ROS parameters."""
    yield from echoes(monkeypatch)


def test_in_real_time_a_step_waits_for_its_own_reference_as_in_lockstep(make):
    """The publisher answers the same state a moment later: without the wait the law flies a period behind."""
    node = make("period_steps:=5", "flight.mode:=realtime")
    node.reference(0, 5, x=10.0)
    node.state(0)
    node.state(5)
    assert node.steps() == [0]
    node.reference(5, 10, x=20.0)
    assert node.steps() == [0, 5]
    assert node.samples[1][1][0].p_w.x == 20.0


def test_in_real_time_a_step_waits_no_longer_than_until_the_next_state(make):
    node = make("period_steps:=5", "flight.mode:=realtime")
    node.reference(0, 5, x=10.0)
    node.state(0)
    node.state(5, x=0.5)
    node.state(6, x=0.6)
    assert node.steps() == [0, 5]
    assert (node.samples[1][0].state.p_w.x, node.samples[1][1][0].p_w.x) == (0.5, 10.0)
    node.reference(5, 10, x=20.0)
    assert node.steps() == [0, 5]
    node.state(11)  # its own due state left out, and so is 10's reference
    assert node.steps() == [0, 5]
    node.state(16)
    assert node.steps() == [0, 5, 11]


def test_in_real_time_an_input_that_is_slower_than_the_node_does_not_delay_it(make):
    node = make("period_steps:=1", "flight.mode:=realtime")
    node.reference(0, 5)
    for step in range(8):
        node.state(step)
    assert node.steps() == list(range(8))
