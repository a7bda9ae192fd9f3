"""What the recorder makes of the stamps of a flight: its time, missing messages, and how far it acknowledges."""

import time

import pytest
import rclpy
from hypothesis import given
from hypothesis import strategies as st
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from std_msgs.msg import UInt32

from quad_bringup.surroundings import reserved_domain
from quad_flight_log.node import numbered
from quad_flight_log.steps import NewestStamp, StepCounter

pytestmark = pytest.mark.unit

PERIOD = 2_000_000
SECOND = 1_000_000_000
SHADOW = "shadow/attitude_setpoint"


def test_the_clock_follows_a_flight_at_its_own_pace_and_ignores_what_is_old():
    clock = NewestStamp(100.0)
    for step in range(5000):
        assert clock.accepts(step * PERIOD, 100.0 + step * 1e-4)  # lockstep, twenty times as fast as real time
    assert clock.accepts(0, 101.0)
    assert clock.newest == 4999 * PERIOD
    assert NewestStamp(0.0).accepts(3 * SECOND, 20.0), "a flight that begins late begins"


def test_a_stamp_of_the_far_future_does_not_move_it():
    clock = NewestStamp(0.0)
    assert clock.accepts(4 * SECOND, 4.0)
    for future in (60 * SECOND, 8_000_000_000 * SECOND, 2**63):
        assert not clock.accepts(future, 4.1)
    assert clock.newest == 4 * SECOND
    assert clock.accepts(4 * SECOND + PERIOD, 4.2)


@pytest.mark.parametrize("stopped", [1.0, 5.0, 60.0])
def test_a_recorder_that_was_stopped_goes_on(stopped):
    clock = NewestStamp(0.0)
    assert clock.accepts(SECOND, 1.0)
    assert clock.accepts(SECOND + int(stopped * SECOND), 1.0 + stopped)


def counted(steps, topic="state", optional=()):
    found = StepCounter({"state": PERIOD, "reference": 5 * PERIOD}, optional)
    for step in steps:
        found.add(topic, step * PERIOD, 0.0)
    return found


def complete(found, now=0.0):
    """Return the last complete plant step."""
    return (found.complete_through(now) + 1) // PERIOD - 1


def test_a_step_is_complete_when_every_topic_that_is_due_has_it():
    found = counted(range(5))
    assert complete(found) == -1
    found.add("reference", 0, 0.0)
    assert complete(found) == 4
    found.add("state", 5 * PERIOD, 0.0)
    assert complete(found) == 4
    found.add("reference", 5 * PERIOD, 0.0)
    assert complete(found) == 5
    assert found.missing_through(5 * PERIOD) == {}


def test_every_message_that_never_came_is_counted_at_start_between_and_end():
    gone = (10, 11, 12, 40)
    found = counted([step for step in range(3, 91) if step not in gone], optional=("reference",))
    assert found.missing_through(99 * PERIOD) == {"state": 3 + 4 + 9}
    assert found.missing_through(90 * PERIOD) == {"state": 3 + 4}


def test_a_required_topic_without_a_message_lacks_all():
    assert counted(range(100)).missing_through(99 * PERIOD) == {"reference": 20}


def test_an_optional_topic_counts_from_its_first_message_on():
    found = counted(range(11), optional=("reference",))
    assert complete(found) == 10
    found.add("reference", 10 * PERIOD, 0.0)
    assert complete(found) == 10
    assert found.missing_through(10 * PERIOD) == {"reference": 2}


@given(st.lists(st.tuples(st.integers(2, 4), st.booleans()), min_size=1, max_size=60))
def test_in_real_time_what_was_published_and_did_not_come_is_lost_and_a_step_left_out_is_not(published):
    """An autopilot's states come 2 to 4 plant steps apart; the sender's number tells which of them are lost."""
    found, step = counted([], optional=("state", "reference")), 0
    for number, (spacing, comes) in enumerate([(0, True), *published, (2, True)], 1):
        step += spacing
        if comes:
            found.add("state", step * PERIOD, 0.0, number)
    lost = sum(not comes for _, comes in published)
    assert found.missing_through((step + 3) * PERIOD) == ({"state": lost} if lost else {})


@pytest.mark.parametrize(
    ("came", "lost"),
    [
        (((0, 1), (1, 2), (2, 900), (3, 3), (4, 1), (5, 2)), 0),
        (((0, 1), (1, 2), (0, 900), (5, 6)), 3),
        (((0, 1), (1, 900), (5, 4)), 3),
    ],
    ids=["a second publisher", "an old message of another hides no loss", "before a new one first came"],
)
def test_losses_with_several_publishers(came, lost):
    found = counted([], optional=("state", "reference"))
    for step, number in came:
        found.add("state", step * PERIOD, 0.0, number)
    assert found.missing_through(5 * PERIOD) == ({"state": lost} if lost else {})


def test_in_real_time_a_topic_that_ends_before_the_flight_is_named():
    found = counted([], optional=("state", "reference"))
    for step in range(51):
        found.add("state", step * PERIOD, 0.0, step + 1)
    assert found.silent_through(50 * PERIOD) == []
    assert found.silent_through(51 * PERIOD) == ["no message of state after 0.1 s"]
    assert found.missing_through(99 * PERIOD) == {}


@pytest.mark.parametrize("kind", [EventsExecutor, SingleThreadedExecutor])
def test_what_a_reader_that_stands_still_loses_is_counted(kind):
    found, came, numbers = counted([], optional=("state", "reference")), [], []

    def keep(payload):
        came.append(payload)
        found.add("state", int.from_bytes(payload[4:8], "little") * PERIOD, 0.0, numbers[-1])

    with reserved_domain(None) as domain:
        rclpy.init(domain_id=domain)
        sender, reader = rclpy.create_node("sender"), rclpy.create_node("reader")
        reader.create_subscription(UInt32, "state", numbered(keep, numbers.append), 10, raw=True)
        publisher, executor, deadline = sender.create_publisher(UInt32, "state", 10), kind(), 200
        while publisher.get_subscription_count() == 0 and (deadline := deadline - 1):
            time.sleep(0.05)
        for step in range(50):
            publisher.publish(UInt32(data=step))
        publisher.wait_for_all_acked(Duration(seconds=10.0))
        executor.add_node(reader)
        while len(came) < 10 and (deadline := deadline - 1):
            executor.spin_once(0.05)
        executor.shutdown()
        rclpy.shutdown()
    assert found.missing_through(49 * PERIOD) == {"state": 40}


def test_repeats_old_messages_and_unknown_topics_change_nothing():
    found = counted([*range(51), 49, 1], optional=("reference",))
    found.add("truth", 60 * PERIOD, 0.0)
    assert found.missing_through(50 * PERIOD) == {}
    assert complete(found) == 50


def with_shadow(step, now):
    """Return the counter of a flight whose state is at step 1300 and whose shadow answered ``step`` at ``now``."""
    found = StepCounter({"state": PERIOD, SHADOW: 5 * PERIOD}, shadows=[SHADOW], now=100.0)
    for each in range(1301):
        found.add("state", each * PERIOD, now)
    if step >= 0:
        found.add(SHADOW, step * PERIOD, now)
    return found


@pytest.mark.parametrize(("step", "behind"), [(-1, -1), (1000, 1004), (1300, 1300)])
def test_a_shadow_is_waited_for_two_seconds_from_its_last_answer_or_the_beginning(step, behind):
    found = with_shadow(step, 100.0)
    assert [complete(found, now) for now in (101.9, 102.1)] == [behind, 1300]


def test_a_shadow_whose_process_has_ended_is_not_waited_for_until_it_answers_again():
    found = with_shadow(1000, 100.0)
    found.give_up([SHADOW])
    assert complete(found, 100.0) == 1300
    found.add(SHADOW, 1005 * PERIOD, 100.0)
    assert complete(found, 100.1) == 1009


def test_what_a_shadow_lacks_is_no_loss_of_the_flight():
    assert with_shadow(1000, 100.0).missing_through(1300 * PERIOD) == {}
