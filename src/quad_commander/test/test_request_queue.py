"""Requests that wait for a step: order, bound, repetitions."""

import pytest

from quad_commander.request_queue import MOST_SENDERS, PendingRequest, RequestQueue
from quad_core.enumerations import Mode, Request


def queue_of(*asked):
    queue = RequestQueue()
    for one in asked:
        queue.add(one)
    return queue


def all_of(queue, mode=Mode.HOLD):
    found = []
    while (asked := queue.take(mode)) is not None:
        found.append(asked)
    return found


def test_the_most_severe_comes_first_and_equals_in_order_of_arrival():
    order = [Request.MISSION, Request.HOLD, Request.DISARM, Request.LAND, Request.KILL, Request.DESCEND]
    asked = [PendingRequest(request, f"sender {number}") for number, request in enumerate(order)]
    taken = [one.request.name for one in all_of(queue_of(*asked))]
    assert taken == ["KILL", "DESCEND", "LAND", "HOLD", "MISSION", "DISARM"]


@pytest.mark.parametrize(("first", "second", "stays"), [
    (Request.HOLD, Request.LAND, Request.LAND),
    (Request.LAND, Request.HOLD, Request.LAND),
    (Request.KILL, Request.HOLD, Request.KILL),
    (Request.LAND, Request.DISARM, Request.LAND),
    (Request.ARM, Request.TAKEOFF, Request.TAKEOFF),
])  # fmt: skip
def test_of_one_sender_the_newest_waits_and_a_milder_one_hides_none(first, second, stays):
    assert all_of(queue_of(PendingRequest(first, "a"), PendingRequest(second, "a"))) == [PendingRequest(stays, "a")]


def test_the_number_of_senders_is_bounded_and_a_severe_request_always_finds_room():
    queue = RequestQueue()
    for number in range(MOST_SENDERS):
        assert queue.add(PendingRequest(Request.HOLD, f"sender {number}"))
    assert not queue.add(PendingRequest(Request.HOLD, "one more"))
    assert queue.add(PendingRequest(Request.LAND, "operator"))
    taken = all_of(queue)
    assert taken[0] == PendingRequest(Request.LAND, "operator")
    assert len(taken) == MOST_SENDERS


def test_a_refused_stream_does_not_keep_others_waiting():
    queue = RequestQueue()
    queue.add(PendingRequest(Request.DISARM, "stream"))
    queue.add(PendingRequest(Request.MISSION, "operator"))
    queue.add(PendingRequest(Request.DISARM, "stream"))
    assert queue.take(Mode.HOLD) == PendingRequest(Request.MISSION, "operator")
