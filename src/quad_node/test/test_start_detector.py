"""Who was there when the flight began, and who comes into one that is under way."""

import pytest

from quad_node.start_detector import Start, StartDetector

pytestmark = pytest.mark.unit


def joined(ready=None, states=()):
    """Return what is known after READY at ``ready`` and ``states`` of (flying, s since step 0, when it came)."""
    known = StartDetector()
    if ready is not None:
        known.on_ready(ready)
    for state in states:
        known.on_flight_state(*state)
    return known


def test_step_0_is_the_start_in_both_clocks():
    assert joined().find(True, 0) == joined().find(False, 0) == Start.SEEN


def test_in_lockstep_any_other_first_state_is_late():
    assert joined(1.0, [(True, 0.0, 2.0)]).find(True, 5) == Start.MISSED


@pytest.mark.parametrize(
    ("ready", "states", "place"),
    [
        (1.0, [(False, 0.0, 0.5), (True, 0.0, 2.0)], Start.SEEN),
        (1.0, [(False, 0.0, 0.5), (True, 0.5, 2.5)], Start.SEEN),  # it slept over the first of them
        (1.0, [(False, 0.0, 0.5)], Start.SEEN),  # an estimator speaks before the flight
        (1.0, [(True, 8.0, 2.0)], Start.MISSED),
        (1.0, [(False, 0.0, 0.9), (True, 0.0, 0.9), (True, 8.0, 1.1)], Start.MISSED),
        (None, [(False, 0.0, 0.9), (True, 0.0, 0.9)], Start.MISSED),  # its own flight waits until it is ready
        (None, [(False, 0.0, 0.9)], Start.UNKNOWN),
        (1.0, [], Start.UNKNOWN),
        (None, [], Start.UNKNOWN),
    ],
)
def test_in_real_time_a_flight_that_is_older_than_the_node_is_ready_is_another_s(ready, states, place):
    assert joined(ready, states).find(False, 5) == place
