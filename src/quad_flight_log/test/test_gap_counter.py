"""Gaps of a real-time recording, counted by the step."""

from quad_flight_log.recorder.gap_counter import GapCounter

PERIOD = 2_000_000


def fed(steps, topic="state"):
    found = GapCounter({"state": PERIOD, "reference": 5 * PERIOD})
    for step in steps:
        found.add(topic, step * PERIOD)
    return found


def test_nothing_is_missing_of_a_whole_flight():
    assert fed(range(100)).missing == {}
    assert fed(range(0, 100, 5), topic="reference").missing == {}


def test_every_step_that_never_came_is_counted_at_start_between_and_end():
    steps = [step for step in range(3, 90) if step not in (10, 11, 12, 40)]
    assert fed(steps).missing["state"] == 3 + 4
    assert fed(steps).missing_through(99 * PERIOD)["state"] == 3 + 4 + 9


def test_a_slow_topic_that_follows_a_late_plant_lacks_nothing():
    assert fed([0, 5, 11, 16, 22, 26], topic="reference").missing == {}
    assert fed([0, 5, 20, 25], topic="reference").missing == {"reference": 2}


def test_repeats_and_old_ones_are_no_gap():
    assert fed([0, 1, 1, 2, 1, 2, 3]).missing == {}


def test_topics_of_nobody_are_ignored_and_silent_ones_are_waited_for_only_if_they_spoke():
    found = fed(range(10))
    found.add("truth", 5 * PERIOD)
    assert found.reached(9 * PERIOD)
    assert not found.reached(10 * PERIOD)
    found.add("reference", 0)
    assert not found.reached(9 * PERIOD)
