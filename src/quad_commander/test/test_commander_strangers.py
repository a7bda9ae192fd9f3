"""What another run, or who makes mistakes, says on the commander's topics: ignored, refused, named."""

import math
from types import SimpleNamespace

import pytest
from wired_commander import commanders

from quad_commander import node as commander_node
from quad_commander.mode_table import Condition
from quad_msgs.msg import FlightRequest


@pytest.fixture
def make(monkeypatch):
    """Return a function that makes the node with the given ROS parameters."""
    yield from commanders(monkeypatch)


def test_setpoints_of_another_run_keep_no_setpoint_young_and_its_plans_are_none(make, monkeypatch):
    clock = SimpleNamespace(now=1000.0)
    monkeypatch.setattr(commander_node.time, "monotonic", lambda: clock.now)
    node = make("flight.mode:=realtime")
    node.plan(run=1)
    assert node._preflight._plan is None
    for step in range(0, 200, 5):
        node.callbacks["wrench_setpoint"](b"")
        node.setpoint(step, run=1)
        node.mission(step)
        node.state(step)
        clock.now += 0.01
    assert node.modes[-1].raised >> Condition.SETPOINT_LOST & 3 == 1  # the wrench is there
    assert {text for _, kind, text in node.events if kind == "foreign_run"} == {
        "flight/plan of another run ignored",
        "attitude_setpoint of another run ignored",
    }


def test_a_request_for_another_run_is_ignored_and_named(make):
    node = make()
    node.ask(FlightRequest.KILL, run_id="b2")
    node.fly(0, 6)
    assert node.modes[-1].name == "DISARMED"
    assert [kind for _, kind, _ in node.events] == ["foreign_run"]


def test_a_number_that_is_not_finite_is_no_reference_of_a_mission(make):
    node = make()
    node.mission(0, math.nan)
    node.state(0)
    assert node.modes == []
    assert node.counters["rejected"] == 1
