"""What a vehicle interface receives of a commander, and without one of the trajectory and the position controller."""

import os
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from rclpy.serialization import serialize_message

from quad_core.cascade import ROLES
from quad_core.enumerations import GuardRequest
from quad_core.flight_parameters import FlightParameters
from quad_msgs.msg import AttitudeThrust, FlightMode, FlightRequest, TrajectoryPoint
from quad_node import executor
from quad_node.command_link import CommandLink, InputWatch
from quad_node.event_log import EventLog
from quad_node.executor import STARTER, Starter
from quad_node.flight_node import FlightNode
from quad_node.handshake import run_number

RUN = "a1"
NO_PROCESS = 2**22 + 1  # Linux gives no process such a number


class Owner:
    """Stands in for the node of a vehicle interface; its topics are functions."""

    is_foreign = FlightNode.is_foreign

    def __init__(self, lockstep=False, commanded=False, roles=tuple(ROLES)):
        self.flight, self.role, self.run = FlightParameters(run_id=RUN), "simulator", run_number(RUN)
        self.lockstep, self.commanded, self.roles, self.slept = lockstep, commanded, roles, 0.0
        self.told, self.sent, self.callbacks, self.progressed, self.links = [], [], {}, 0, self
        self.events = EventLog("/x", Mock(), SimpleNamespace(publish=lambda event: self.told.append(event.kind)))
        self.starter = Starter()

    def publisher(self, topic):
        assert topic == "flight/request"
        return SimpleNamespace(publish=self.sent.append)

    def subscribe(self, topic, callback, raw):
        self.callbacks[topic] = callback

    def progress(self):
        self.progressed += 1

    def receive(self, topic, message):
        self.callbacks[topic](serialize_message(message))

    def mode(self, step, mode, run_id=RUN, **fields):
        self.receive(
            "flight/mode", FlightMode(step=step, next_step=step + 5, mode=mode, run=run_number(run_id), **fields)
        )

    def setpoint(self, run_id=RUN):
        self.receive("attitude_setpoint", AttitudeThrust(run=run_number(run_id)))


@pytest.fixture
def owner():
    return Owner()


@pytest.fixture
def link(owner):
    return CommandLink(owner, owner.progress)


@pytest.fixture
def clock():
    return SimpleNamespace(now=100.0)


def watching(owner, clock, period=5):
    return InputWatch(owner, lambda role: period, lambda: clock.now)


def test_a_mode_holds_for_its_steps_and_lets_the_plant_go_on(owner, link):
    assert not link.holds(0)
    owner.mode(10, FlightMode.HOLD)
    assert [link.holds(step) for step in (9, 10, 14, 15)] == [False, True, True, False]
    assert owner.progressed == 1


@pytest.mark.parametrize(("mode", "armed"), [
    (FlightMode.DISARMED, False),
    (FlightMode.ARMING, False),
    (FlightMode.TAKEOFF, True),
    (FlightMode.DESCEND, True),
    (FlightMode.PILOT, False),
    (FlightMode.KILL, True),
])  # fmt: skip
def test_the_motors_rest_on_the_ground_and_under_a_pilot_and_killing_is_the_guards(owner, link, mode, armed):
    assert not link.armed
    owner.mode(0, mode, guard_request=GuardRequest.DESCEND)
    assert (link.armed, link.mode.value.guard_request) == (armed, GuardRequest.DESCEND)


def test_the_end_comes_with_its_outcome(owner, link):
    owner.mode(0, FlightMode.LAND, outcome="not yet")
    assert (link.is_over, link.outcome) == (False, "")
    owner.mode(5, FlightMode.DISARMED, is_over=True, outcome="why")
    assert (link.is_over, link.outcome) == (True, "why")


def test_a_mode_that_is_malformed_or_of_another_run_is_rejected(owner, link):
    owner.callbacks["flight/mode"](b"\x00\x01\x00\x00abc")
    owner.mode(0, FlightMode.KILL, run_id=RUN + "2")
    assert (link.mode.step, owner.told) == (-1, ["rejected_malformed", "foreign_run"])


def test_the_end_is_asked_for_once_with_its_reason(owner, link):
    link.pass_on("")
    assert owner.sent == []
    link.pass_on("SIGINT")
    link.pass_on("SIGINT")
    assert [(sent.request, sent.run, sent.sender) for sent in owner.sent] == [
        (FlightRequest.END, owner.run, "simulator was asked to end by SIGINT")
    ]


@pytest.mark.parametrize("is_direct", [True, False])
def test_a_starter_that_is_gone_ends_the_flight(owner, monkeypatch, is_direct):
    starter = os.getpid()
    monkeypatch.setenv(STARTER, str(starter))
    monkeypatch.setattr(executor.os, "getppid", lambda: starter if is_direct else 4711)  # a script between
    link, owner.starter = CommandLink(owner, list), (gone := Starter())
    link.pass_on("")
    assert owner.sent == []
    if is_direct:
        monkeypatch.setattr(executor.os, "getppid", lambda: 1)
    else:
        gone.pid = NO_PROCESS
    link.pass_on("")
    assert [sent.sender for sent in owner.sent] == ["the process that started the flight is gone"]


def after(watch, clock, seconds, has_states=True):
    """Return what the watch says after some time in which its owner published states and looked every 50 ms."""
    said = ""
    watch.note_state()
    for _ in range(round(seconds / 0.05)):
        clock.now += 0.05
        if has_states:
            watch.note_state()
        said = said or watch.silent()
    return said


@pytest.mark.parametrize(("topic", "message", "period", "limit", "said"), [
    ("attitude_setpoint", AttitudeThrust, 5, 0.25, "position_controller does not answer: attitude_setpoint older"),
    ("reference", TrajectoryPoint, 5, 1.95, "trajectory does not answer: reference older than 2 s"),
    # three periods of 0.5 s
    ("attitude_setpoint", AttitudeThrust, 250, 1.45, "position_controller does not answer: attitude_setpoint"),
])  # fmt: skip
def test_a_node_that_falls_silent_is_named_after_its_time(owner, clock, topic, message, period, limit, said):
    watch = watching(owner, clock, period)
    assert after(watch, clock, 5.0) == ""  # nothing has come yet: the handshake waits for it
    owner.receive(topic, message(run=owner.run))
    assert after(watch, clock, 60.0, has_states=False) == ""  # without states there is nothing to answer
    owner.receive(topic, message(run=owner.run))
    assert after(watch, clock, limit) == ""
    assert after(watch, clock, 0.15).startswith(said)


def test_setpoints_of_another_run_are_none(owner, clock):
    watch = watching(owner, clock)
    owner.setpoint()
    for _ in range(8):
        owner.setpoint(run_id="b2")
        said = after(watch, clock, 0.05)
    assert said


def test_a_vehicle_interface_that_stood_still_names_no_node(owner, clock):
    watch = watching(owner, clock)
    owner.setpoint()
    assert after(watch, clock, 0.1) == ""
    clock.now, owner.slept = clock.now + 5.0, 5.0
    watch.note_state()
    assert watch.silent() == ""
    owner.slept = 0.0
    owner.setpoint()
    assert after(watch, clock, 0.3) == ""


@pytest.mark.parametrize("options", [{"lockstep": True}, {"roles": ("simulator", "attitude_controller")}])
def test_in_lockstep_and_where_no_node_sends_it_nothing_is_watched(options, clock):
    owner = Owner(**options)
    watch = watching(owner, clock)
    assert not owner.callbacks
    assert after(watch, clock, 10.0) == ""


def test_where_the_flights_time_is_halted_nobody_is_silent(clock):
    owner = Owner(commanded=True, roles=(*ROLES, "commander"))
    watch = watching(owner, clock)
    watch.note("flight/mode")
    for _ in range(100):  # beats of a plant that waits, whatever the clock on the wall says
        watch.note_state()
        assert watch.silent() == ""


def test_a_commander_that_leaves_a_state_unanswered_is_named_after_half_a_second(clock):
    owner = Owner(commanded=True, roles=(*ROLES, "commander"))
    watch = watching(owner, clock)
    watch.note("flight/mode")
    clock.now += 60.0  # without a state: what comes then waits from there on
    assert after(watch, clock, 0.45) == ""
    assert after(watch, clock, 0.15) == "commander does not answer: flight/mode older than 0.5 s"
