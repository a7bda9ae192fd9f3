"""What a node says on flight/events, and how often."""

from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from quad_msgs.msg import FlightEvent
from quad_node.codec import ForeignRunError
from quad_node.event_log import EventLog


@pytest.fixture
def events():
    made = EventLog("/uav/simulator", Mock(), SimpleNamespace(publish=lambda event: made.sent.append(event)))
    made.sent = []
    return made


def test_of_a_kind_one_a_second_is_said_an_error_and_what_matters_always_and_all_are_counted(events):
    for _ in range(3):
        events.warn("late", "by 60 ms", 2_000_000)
        events.info("mode", "HOLD", always=True)
        events.error("failed", "why")
    assert [event.kind for event in events.sent] == ["late", "mode", "failed", "mode", "failed", "mode", "failed"]
    first = events.sent[0]
    assert (first.node, first.severity, first.text) == ("/uav/simulator", FlightEvent.WARNING, "by 60 ms")
    assert (first.stamp.nanosec, events.counts) == (2_000_000, {"late": 3, "mode": 3, "failed": 3})


def test_an_event_without_a_stamp_of_its_own_has_the_time_of_its_node():
    times = iter((7_210_000_000, 7_212_000_000, 7_214_000_000, 7_216_000_000))
    sent = []
    events = EventLog("/x", Mock(), SimpleNamespace(publish=sent.append), now=lambda: next(times))
    events.warn("infeasible_reference", "3.72 m")
    events.error("given_up", "why")
    events.unusable("state", b"abc", ValueError("cut"))
    events.info("mode", "HOLD", 2_000_000)
    assert [event.stamp.sec * 10**9 + event.stamp.nanosec for event in sent] == [
        7_210_000_000,
        7_212_000_000,
        7_214_000_000,
        2_000_000,
    ]


@pytest.mark.parametrize(
    ("error", "kind", "rejected"), [(ForeignRunError(), "foreign_run", 0), (ValueError("cut"), "rejected_malformed", 1)]
)
def test_a_payload_of_another_run_is_no_malformed_one(events, error, kind, rejected):
    events.unusable("state", b"abc", error)
    assert ([event.kind for event in events.sent], events.counts["rejected"]) == ([kind], rejected)
