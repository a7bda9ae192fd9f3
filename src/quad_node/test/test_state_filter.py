"""Which state a node accepts next, and whether it saw the start of its flight."""

import math

import pytest

from quad_node.state_filter import LARGEST_GAP, QUIET, SequenceFilter, saw_start

pytestmark = pytest.mark.unit

PERIOD = 2_000_000  # ns
STEP = PERIOD * 1e-9  # s
FAR = 2**63


class Flight:
    """States in their order."""

    def __init__(self, lockstep=False):
        self.order, self.accepted = SequenceFilter(PERIOD, lockstep), []

    def say(self, *steps):
        for step in steps:
            if self.order.allows(step):
                self.order.take(step)
                self.accepted.append(step)
        return self


def test_states_follow_each_other_and_may_come_again():
    assert Flight().say(0, 1, 1, 2, 7).accepted == [0, 1, 1, 2, 7]


@pytest.mark.parametrize("count", [1, 50])
@pytest.mark.parametrize("far", [FAR, 100_000, 2])
def test_states_of_another_run_among_the_flights_are_rejected(count, far):
    flight = Flight().say(*range(1000, 1010))
    for step in range(1010, 1100):
        flight.say(*[far] * count).say(step)
    assert flight.accepted == [*range(1000, 1100)]


def test_after_a_real_gap_states_are_accepted_that_go_on():
    flight = Flight().say(0, 1, *range(1000, 1030))
    assert flight.accepted == [0, 1, *range(1000 + round(QUIET / STEP) + 1, 1030)]


@pytest.mark.parametrize("lockstep", [False, True])
def test_our_own_states_repeated_later_are_never_taken_however_slowly_the_flight_goes_on(lockstep):
    flight = Flight(lockstep)
    for step in range(1000, 1400, 10):  # ten copies of old states between two of ours
        flight.say(step, *range(step - 300, step - 290))
    assert flight.accepted == [*range(1000, 1400, 10)]
    flight.say(*range(1000, 1300))  # while the plant waits
    assert (flight.accepted[-1] == 1390) == lockstep


def test_in_lockstep_a_foreign_state_that_was_accepted_costs_none_of_ours():
    assert Flight(lockstep=True).say(0, 1, 200, 2, 3).accepted == [0, 1, 200, 2, 3]


@pytest.mark.parametrize("far", [FAR, 200])  # one that may follow, too: 0.4 s ahead
def test_after_a_foreign_state_was_accepted_ours_are_again_before_the_guard_takes_over(far):
    flight = Flight().say(far).say(*range(100))
    first = flight.accepted[1]
    assert first * STEP < QUIET + 3 * STEP < 0.05
    assert flight.accepted == [far, *range(first, 100)]


def test_what_is_far_ahead_is_told_from_what_is_old():
    order = SequenceFilter(PERIOD)
    order.take(1000)
    largest = round(LARGEST_GAP / STEP)
    assert [order.is_far_ahead(step) for step in (0, 999, 1000 + largest, 1001 + largest)] == [False] * 3 + [True]


NOT, NEVER = math.inf, math.inf


@pytest.mark.parametrize(("lockstep", "step", "ready", "began", "saw"), [
    (True, 0, NEVER, None, True),
    (False, 0, NEVER, None, True),
    (True, 5, 1.0, 2.0, False),
    (False, 5, 1.0, 2.0, True),
    (False, 5, 1.0, NOT, True),  # an estimator speaks before the flight
    (False, 5, 1.0, -6.0, False),
    (False, 5, NEVER, 0.9, False),  # its own flight waits until it is ready
    (False, 5, NEVER, NOT, None),
    (False, 5, 1.0, None, None),
])  # fmt: skip
def test_in_real_time_a_flight_that_is_older_than_the_node_is_ready_is_another_s(lockstep, step, ready, began, saw):
    assert saw_start(lockstep, step, ready, began) is saw
