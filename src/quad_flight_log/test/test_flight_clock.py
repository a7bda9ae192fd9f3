"""The recorder's clock: it follows the flight, whatever a stranger stamps."""

import pytest

from quad_flight_log.recorder.flight_clock import FlightClock

pytestmark = pytest.mark.unit

SECOND = 1_000_000_000


def test_it_follows_a_flight_at_its_own_pace_and_ignores_what_is_old():
    clock = FlightClock(100.0)
    for step in range(5000):
        assert clock.believes(step * 2_000_000, 100.0 + step * 1e-4)  # lockstep, twenty times as fast as real time
    assert clock.believes(0, 101.0)
    assert clock.newest == 4999 * 2_000_000


def test_a_stamp_of_the_far_future_does_not_move_it():
    clock = FlightClock(0.0)
    assert clock.believes(4 * SECOND, 4.0)
    for future in (60 * SECOND, 8_000_000_000 * SECOND, 2**63):
        assert not clock.believes(future, 4.1)
    assert clock.newest == 4 * SECOND
    assert clock.believes(4 * SECOND + 2_000_000, 4.2)


@pytest.mark.parametrize("stopped", [1.0, 5.0, 60.0])
def test_a_recorder_that_was_stopped_goes_on(stopped):
    clock = FlightClock(0.0)
    assert clock.believes(SECOND, 1.0)
    assert clock.believes(SECOND + int(stopped * SECOND), 1.0 + stopped)


def test_a_flight_that_begins_late_begins():
    assert FlightClock(0.0).believes(3 * SECOND, 20.0)
