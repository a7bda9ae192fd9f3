"""Who of two controllers is obeyed: when one takes over, and what both send then."""

import time
import zlib

import pytest
from paired_controllers import (
    ASIDE,
    BOTH,
    FLYING,
    INSIDE,
    REALTIME,
    SHADOW,
    answered,
    called,
    controllers,
    heard,
    told,
    topics_of,
    warm,
)

from quad_node.inputs import Arrival


@pytest.fixture
def make(monkeypatch):
    with controllers(monkeypatch) as built:
        yield built


def test_a_standby_stays_aside_while_the_other_answers(make):
    node = make(REALTIME)
    for step in range(5, 100, 5):
        heard(node, step - 5)
        node.exchange._heard -= 1.0  # a long time without anything new, but no step is lacking
        assert topics_of(node, step) == ASIDE


def test_in_real_time_it_flies_when_the_other_is_late_in_steps_and_by_the_clock(make):
    node = make(REALTIME)
    heard(node, 5)
    for step in (5, 10, 15, 20):
        assert topics_of(node, step) == ASIDE
    assert topics_of(node, 25) == ASIDE  # 40 ms in steps, but just heard: its own queue was long
    node.exchange._heard = time.monotonic() - 0.05
    assert topics_of(node, 30) == BOTH
    heard(node, 35)
    assert topics_of(node, 40) == BOTH  # it does not give back


def test_answers_of_another_run_do_not_keep_a_standby_aside(make):
    node = make(REALTIME, "flight.run_id:=ours")
    heard(node, 5, run=zlib.crc32(b"ours"))
    for step in (5, 10, 15, 20, 25):
        assert topics_of(node, step) == ASIDE
    node.exchange._heard = time.monotonic() - 0.05
    heard(node, 30, run=zlib.crc32(b"theirs"))
    assert topics_of(node, 30) == BOTH
    assert node.counters["foreign_run"] == 2


def test_in_lockstep_it_flies_when_the_plant_asks_again(make):
    node = make()
    heard(node, 0)
    answered(node, 5)
    node.on_repeat(5)
    assert [publisher.topic_name for publisher, _ in node.answers] == ASIDE
    node.on_repeat(5)
    found = {publisher.topic_name: bytes(message) for publisher, message in node.answers}
    assert set(found) == set(BOTH)
    assert found["/attitude_setpoint"] == found["/shadow/attitude_setpoint"]


def test_in_lockstep_it_sends_what_the_other_sent_last_and_what_it_did_not_get_out(make):
    node = make()
    heard(node, 5)
    heard(node, 10, [0])  # killed between its two messages
    for step in (5, 10, 15):
        answered(node, step)
    node.on_repeat(15)
    node.on_repeat(15)
    sent = [(publisher.topic_name, node.exchange._recent.step_of(message)) for publisher, message in node.answers]
    assert sent == [
        ("/attitude_setpoint", 5),  # who died in the middle of sending has reached some readers only
        ("/attitude_setpoint", 10),
        ("/position_controller/internals", 5),
        ("/attitude_setpoint", 15),
        ("/position_controller/internals", 10),
        ("/position_controller/internals", 15),
        (ASIDE[0], 15),
        (ASIDE[1], 15),
    ]


@pytest.mark.parametrize("alive", [True, False])
def test_in_lockstep_an_answer_that_reached_the_shadow_alone_is_sent_for_all(make, alive):
    node = make()
    answered(node, 5)
    heard(node, 5)
    for _ in range(4):  # fewer than the plant's patience, simulator.repeat_limit
        assert len(node.answers) == len(ASIDE)
        node.on_repeat(5)
        if alive:
            heard(node, 5)
    assert (len(node.answers) == len(ASIDE)) == alive


def test_in_real_time_it_flies_on_request_some_answers_later(make):
    node = make(REALTIME)
    heard(node, 0)
    answered(node, 0)
    assert called(node) == (True, "takes effect 20 answers later")
    assert called(node) == (False, "asked for already")
    for step in range(5, 105, 5):  # said 20 answers of 5 steps ahead, so that the other can stop in time
        heard(node, step)
        assert topics_of(node, step) == ASIDE
    assert topics_of(node, 105) == BOTH
    assert called(node) == (
        False,
        "shadow_position_controller flies already; the other one is asked by position_controller/take_over",
    )


@pytest.mark.parametrize("computed", [True, False])
def test_in_lockstep_it_flies_on_request_from_where_the_other_left(make, computed):
    node, own = make(), "/shadow_position_controller"
    warm(node, seconds=0.1)
    assert called(node)[0]
    assert topics_of(node, 55) == ASIDE  # says that it flies from 155 on
    for step in range(60, 165, 5):
        heard(node, step)
        assert topics_of(node, step) == ASIDE  # the other may have answered 155, and says so
    told(node, SHADOW, 155, sender=own)  # its own message comes back
    assert topics_of(node, 165) == ASIDE
    told(node, SHADOW, 165 if computed else 170)
    if computed:  # the plant waits for this answer: it goes out at once
        assert [publisher.topic_name for publisher, _ in node.answers] == [*FLYING, *ASIDE]
    assert topics_of(node, 170) == BOTH


@pytest.mark.parametrize(
    ("role", "run_id", "stands_by"),
    [(SHADOW, "run", True), ("shadow_attitude_controller", "run", False), (SHADOW, "another", False)],
)
def test_who_is_replaced_stands_by(make, role, run_id, stands_by):
    node = make("flight.run_id:=run", shadow=False)
    told(node, role, 10, run_id=run_id)
    node.answers = [("publisher", b"")]
    node.on_repeat(5)
    assert node.answers
    assert topics_of(node, 5) == FLYING
    node.on_repeat(10)
    assert bool(node.answers) != stands_by
    assert topics_of(node, 10) == ([] if stands_by else FLYING)
    assert node.exchange.flies != stands_by


def test_who_was_replaced_may_come_back_without_a_pause(make):
    node = make(REALTIME, shadow=False)
    answered(node, 0)
    told(node, SHADOW, 5)
    assert topics_of(node, 5) == []
    assert called(node)[0]
    for step in range(10, 115, 5):
        heard(node, step)
        found = topics_of(node, step)
    assert found == FLYING
    told(node, SHADOW, 110)  # of equal steps the controller's counts
    assert topics_of(node, 115) == FLYING
    told(node, SHADOW, 120)
    assert topics_of(node, 120) == []


def test_who_was_replaced_takes_over_again_when_nothing_comes_of_the_other(make):
    node = make(REALTIME, shadow=False)
    answered(node, 0)
    told(node, SHADOW, 5)
    assert [topics_of(node, step) for step in (5, 10)] == [[], []]
    node.exchange._heard -= 1.0
    assert topics_of(node, 15) == FLYING  # more than 20 ms after its own last answer


def test_it_announces_itself_ahead_of_what_the_other_has_answered(make):
    node = make(REALTIME)
    answered(node, 0)
    heard(node, 200)  # this node is slow
    assert called(node)[0]
    answered(node, 5)
    assert node.exchange._announced == 300


@pytest.mark.parametrize("shadow", [True, False])
def test_only_who_stands_by_leaves_out_a_step_whose_input_is_past(make, shadow):
    node = make(shadow=shadow)
    taken = node._inputs[0]
    assert not node.leaves_out(taken, 100)
    taken.put(Arrival(95, 100, None, 0.0))
    assert not node.leaves_out(taken, 100)  # it may be on its way
    taken.put(Arrival(105, 110, None, 0.0))
    assert node.leaves_out(taken, 100) == shadow


@pytest.mark.parametrize(("standby", "found"), [("true", {"attitude_setpoint", INSIDE}), ("false", set())])
def test_two_senders_are_right_only_where_one_stands_by(make, standby, found):
    assert set(make(f"flight.standby:={standby}").standby_topics) == found
