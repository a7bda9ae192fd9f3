"""The position controller's node says once when a reference asks for too much."""

import pytest

from quad_core.types import PositionInternals, Quat, Vec3, VehicleState
from quad_node.responder import Sample
from quad_position_ctrl.node import make

STATE = VehicleState(Vec3(), Vec3(), Quat(), Vec3())


def sample(t):
    """Return the sample of time ``t`` s."""
    return Sample(round(t * 500), round(t * 1e9), STATE, 0.01)


@pytest.fixture
def node(monkeypatch, start_node):
    made = start_node(make)
    made.said = []
    monkeypatch.setattr(made.node.events, "warn", lambda *said: made.said.append(said))
    return made


def test_two_seconds_at_a_limit_without_coming_nearer_are_said_once(node):
    far = PositionInternals(position_error=Vec3(0.0, 1.5, 0.0), tilt_limited=True)
    for t in (0.5, 1.0, 2.4, 2.5):
        node.on_internals(far, sample(t))
    assert node.said == []
    for t in (2.52, 3.0, 9.0):
        node.on_internals(far, sample(t))
    ((kind, text),) = node.said
    assert kind == "infeasible_reference"
    assert text == "1.50 m from the reference and no nearer for 2.0 s, at the tilt limit of aibs"


def test_a_far_reference_that_comes_nearer_is_not_said(node):
    for k in range(100):
        error = Vec3(0.0, 13.0 - 0.1 * k, 0.0)
        node.on_internals(PositionInternals(position_error=error, velocity_limited=True), sample(0.5 + 0.1 * k))
    assert node.said == []
