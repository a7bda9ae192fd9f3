"""What the recorder may acknowledge, and what it makes of repeats, conflicts and strays."""

import random

import pytest

from quad_flight_log.recorder.step_tracker import Arrival, StepTracker

PERIOD = 2_000_000


def tracker(**periods):
    return StepTracker(periods or {"state": 1, "setpoint": 5}, PERIOD)


def add(found, topic, step, payload=b"x"):
    return found.add(topic, step * PERIOD, payload)


def test_a_step_is_complete_when_every_topic_that_is_due_has_it():
    found = tracker()
    assert found.complete_through() == -1
    add(found, "state", 0)
    assert found.complete_through() == -1
    add(found, "setpoint", 0)
    assert found.complete_through() == 0
    for step in range(1, 5):
        add(found, "state", step)
    assert found.complete_through() == 4
    add(found, "state", 5)
    assert found.complete_through() == 4
    add(found, "setpoint", 5)
    assert found.complete_through() == 5


def test_any_order_of_arrival_ends_the_same():
    arrivals = [("state", step) for step in range(40)] + [("setpoint", step) for step in range(0, 40, 5)]
    for seed in range(5):
        random.Random(seed).shuffle(arrivals)
        found = tracker()
        assert {add(found, *arrival) for arrival in arrivals} == {Arrival.NEW}
        assert found.complete_through() == 39
        assert found.missing_through(39) == {}


def test_repeats_conflicts_and_strays_are_told_apart():
    found = tracker()
    assert add(found, "state", 0, b"a") is Arrival.NEW
    assert add(found, "state", 0, b"a") is Arrival.REPEAT
    assert add(found, "state", 0, b"b") is Arrival.CONFLICT
    assert add(found, "state", 3, b"c") is Arrival.NEW
    assert add(found, "state", 3, b"d") is Arrival.CONFLICT
    assert add(found, "setpoint", 3) is Arrival.OFF_STEP
    assert found.add("state", PERIOD + 1, b"") is Arrival.OFF_STEP
    assert found.add("state", -PERIOD, b"") is Arrival.OFF_STEP


def test_what_never_came_is_counted_per_topic():
    found = tracker()
    for step in (0, 1, 2, 4, 7):
        add(found, "state", step)
    add(found, "setpoint", 5)
    assert found.complete_through() == -1
    assert found.missing_through(7) == {"state": 3, "setpoint": 1}
    assert found.missing_through(2) == {"setpoint": 1}


def test_a_repeat_older_than_the_memory_is_still_a_repeat():
    found = StepTracker({"state": 1}, PERIOD, memory=4)
    for step in range(10):
        add(found, "state", step, bytes([step]))
    assert add(found, "state", 9, b"\x09") is Arrival.REPEAT
    assert add(found, "state", 9, b"other") is Arrival.CONFLICT
    assert add(found, "state", 0, b"other") is Arrival.REPEAT


def test_impossible_periods_are_refused():
    with pytest.raises(ValueError, match="positive"):
        StepTracker({"state": 0}, PERIOD)
    with pytest.raises(ValueError, match="positive"):
        StepTracker({"state": 1}, 0)


def test_an_optional_topic_counts_from_its_first_message_on():
    found = StepTracker({"state": 1}, PERIOD, optional={"truth": 1, "wind": 5})
    for step in range(3):
        add(found, "state", step)
    assert found.complete_through() == 2
    assert found.missing_through(2) == {}
    assert add(found, "wind", 3) is Arrival.OFF_STEP
    assert found.complete_through() == 2
    assert add(found, "truth", 0) is Arrival.NEW
    assert found.complete_through() == 0
    assert found.missing_through(2) == {"truth": 2}
    assert add(found, "truth", 0) is Arrival.REPEAT


def test_what_an_optional_topic_began_without_is_missing_but_holds_up_nothing():
    found = StepTracker({"state": 1}, PERIOD, optional={"truth": 1, "wind": 5})
    for step in range(11):
        add(found, "state", step)
    for step in (7, 8, 9, 10):
        add(found, "truth", step)
    add(found, "wind", 10)
    assert found.complete_through() == 10
    assert found.missing_through(10) == {"truth": 7, "wind": 2}


def test_it_names_the_topic_that_holds_up_the_rest():
    found = StepTracker({"state": 1, "setpoint": 5}, PERIOD, optional={"truth": 1})
    for step in range(4):
        add(found, "state", step)
    add(found, "setpoint", 0)
    add(found, "truth", 0)
    assert found.behind(4) == "truth"
    for step in (1, 2, 3):
        add(found, "truth", step)
    assert found.behind(4) == ""
