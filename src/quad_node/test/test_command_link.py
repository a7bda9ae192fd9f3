"""What a vehicle interface receives of a commander, and without one of the trajectory and the position controller."""

import zlib
from types import SimpleNamespace

import pytest
from rclpy.serialization import serialize_message

from quad_core.cascade import ROLES
from quad_core.flight_parameters import FlightParameters
from quad_guard.guard import ASK_DESCEND
from quad_msgs.msg import AttitudeThrust, FlightMode, FlightRequest, TrajectoryPoint
from quad_node import command_link
from quad_node.command_link import STARTER, CommandLink, SetpointWatch


class Owner:
    """Stands in for the node of the vehicle's owner."""

    def __init__(self):
        self.flight, self.role, self.lockstep = SimpleNamespace(run_id="a1"), "simulator", False
        self.counters, self.told, self.sent, self.callbacks = {"rejected": 0}, [], [], {}

    def publisher(self, topic):
        assert topic == "flight/request"
        return SimpleNamespace(publish=self.sent.append)

    def subscribe(self, topic, callback, raw=False):
        self.callbacks[topic] = callback

    def event(self, severity, kind, text):
        self.told.append(kind)


@pytest.fixture
def owner():
    return Owner()


@pytest.fixture
def link(owner):
    owner.progressed = []
    return CommandLink(owner, lambda: owner.progressed.append(True))


def told(owner, step, mode, **fields):
    message = FlightMode(step=step, next_step=step + 5, mode=mode, run_id="a1", name="X", **fields)
    owner.callbacks["flight/mode"](serialize_message(message))


def test_a_mode_holds_for_its_steps_and_lets_the_plant_go_on(owner, link):
    assert not link.holds(0)
    told(owner, 10, FlightMode.HOLD)
    assert [link.holds(step) for step in (9, 10, 14, 15)] == [False, True, True, False]
    assert owner.progressed == [True]


@pytest.mark.parametrize(
    ("mode", "armed"),
    [
        (FlightMode.DISARMED, False),
        (FlightMode.ARMING, False),
        (FlightMode.TAKEOFF, True),
        (FlightMode.DESCEND, True),
        (FlightMode.PILOT, False),
        (FlightMode.KILL, True),
    ],
)
def test_the_motors_rest_on_the_ground_and_under_a_pilot_and_killing_is_the_guards(owner, link, mode, armed):
    assert not link.armed
    told(owner, 0, mode, guard_request=ASK_DESCEND)
    assert (link.armed, link.guard_request) == (armed, ASK_DESCEND)


def test_the_end_comes_with_its_outcome(owner, link):
    told(owner, 0, FlightMode.LAND, outcome="not yet")
    assert (link.is_over, link.outcome) == (False, "")
    told(owner, 5, FlightMode.DISARMED, is_over=True, outcome="why")
    assert (link.is_over, link.outcome) == (True, "why")


def test_what_is_malformed_or_of_another_run_is_not_obeyed(owner, link):
    owner.callbacks["flight/mode"](b"\x00\x01\x00\x00abc")
    owner.callbacks["flight/mode"](serialize_message(FlightMode(mode=FlightMode.KILL, run_id="b2")))
    assert (link.mode, owner.told, owner.counters["rejected"]) == (None, ["rejected_malformed", "foreign_run"], 1)


def test_a_commander_that_was_heard_and_falls_silent_is_lost(owner, link, monkeypatch):
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(command_link.time, "monotonic", lambda: clock.now)
    assert not link.is_lost
    told(owner, 0, FlightMode.HOLD)
    clock.now = 100.4
    assert not link.is_lost
    clock.now = 100.6
    assert link.is_lost
    given_up = []
    link.pass_on("", given_up.append)
    owner.lockstep = True
    link.pass_on("", given_up.append)
    assert given_up == ["commander: no flight/mode any more"]


def test_the_end_is_asked_for_once_with_its_reason(owner, link):
    link.pass_on("", list)
    assert owner.sent == []
    link.pass_on("SIGINT", list)
    link.pass_on("SIGINT", list)
    assert [(sent.request, sent.run_id, sent.sender) for sent in owner.sent] == [
        (FlightRequest.END, "a1", "simulator was asked to end by SIGINT")
    ]


def test_a_starter_that_is_gone_ends_the_flight(owner, monkeypatch):
    monkeypatch.setenv(STARTER, "4711")
    monkeypatch.setattr(command_link.os, "getppid", lambda: 4711)
    link = CommandLink(owner, list)
    link.pass_on("", list)
    assert owner.sent == []
    monkeypatch.setattr(command_link.os, "getppid", lambda: 1)
    link.pass_on("", list)
    assert [sent.sender for sent in owner.sent] == ["the process that started the flight is gone"]


def test_an_owner_that_slept_does_not_call_the_commander_lost(owner, link, monkeypatch):
    clock, given_up = SimpleNamespace(now=100.0), []
    monkeypatch.setattr(command_link.time, "monotonic", lambda: clock.now)
    told(owner, 0, FlightMode.HOLD)
    link.pass_on("", given_up.append)
    clock.now = 101.0
    link.pass_on("", given_up.append)
    assert given_up == []
    for _ in range(12):
        clock.now += 0.05
        link.pass_on("", given_up.append)
    assert given_up[0] == "commander: no flight/mode any more"


OURS = zlib.crc32(b"ours")


class Controlled:
    """What the watch needs of a node; ``said`` lets a setpoint arrive."""

    def __init__(self, lockstep=False, commanded=False, roles=tuple(ROLES)):
        self.flight, self.callbacks = FlightParameters(), {}
        self.lockstep, self.commanded, self.roles = lockstep, commanded, roles

    def subscribe(self, topic, callback, raw):
        self.callbacks[topic] = callback

    def is_foreign(self, topic, run):
        return run != OURS

    def said(self, run=OURS):
        self.callbacks["attitude_setpoint"](serialize_message(AttitudeThrust(run=run)))


@pytest.fixture
def clock(monkeypatch):
    found = SimpleNamespace(now=100.0)
    monkeypatch.setattr(command_link.time, "monotonic", lambda: found.now)
    return found


def after(watch, clock, seconds, has_states=True):
    """Return what the watch says after some time in which its owner published states and looked every 50 ms."""
    said, asked_at = "", clock.now
    for _ in range(round(seconds / 0.05)):
        clock.now += 0.05
        said = said or watch.silent(clock.now if has_states else asked_at)
    return said


def test_a_silent_position_controller_is_named_after_its_time(clock):
    owner = Controlled()
    watch = SetpointWatch(owner, lambda role: 5)
    assert after(watch, clock, 5.0) == ""  # nothing has come yet: the handshake waits for it
    owner.said()
    assert after(watch, clock, 0.3) == ""
    assert after(watch, clock, 0.1) == "position_controller does not answer: attitude_setpoint older than 0.3 s"


def test_a_silent_trajectory_is_named_after_its_time(clock):
    owner = Controlled()
    watch = SetpointWatch(owner, lambda role: 5)
    owner.callbacks["reference"](serialize_message(TrajectoryPoint(run=OURS)))
    assert after(watch, clock, 2.0) == ""
    assert after(watch, clock, 0.1) == "trajectory does not answer: reference older than 2 s"
    commanded = Controlled(commanded=True)
    SetpointWatch(commanded, lambda role: 5)
    assert commanded.callbacks == {}, "the commander decides"


def test_a_controller_that_gets_no_states_has_nothing_to_answer(clock):
    owner = Controlled()
    watch = SetpointWatch(owner, lambda role: 5)
    assert after(watch, clock, 0.1) == ""
    owner.said()
    assert after(watch, clock, 60.0, has_states=False) == ""
    assert after(watch, clock, 0.5)


def test_setpoints_of_another_run_are_none(clock):
    owner = Controlled()
    watch = SetpointWatch(owner, lambda role: 5)
    owner.said()
    for _ in range(8):
        owner.said(run=0)
        said = after(watch, clock, 0.05)
    assert said


def test_a_slow_controller_may_take_three_of_its_periods(clock):
    owner = Controlled()
    watch = SetpointWatch(owner, lambda role: 250)  # 0.5 s
    owner.said()
    assert after(watch, clock, 1.45) == ""
    assert after(watch, clock, 0.15)


def test_an_owner_that_slept_holds_it_against_nobody(clock):
    owner = Controlled()
    watch = SetpointWatch(owner, lambda role: 5)
    owner.said()
    assert after(watch, clock, 0.1) == ""
    clock.now += 5.0
    assert watch.silent(clock.now) == ""
    owner.said()
    assert after(watch, clock, 0.3) == ""


@pytest.mark.parametrize(
    "owner",
    [Controlled(lockstep=True), Controlled(commanded=True), Controlled(roles=("simulator", "attitude_controller"))],
)
def test_where_another_decides_or_nobody_sends_it_nothing_is_watched(owner):
    watch = SetpointWatch(owner, lambda role: 5)
    assert not owner.callbacks
    assert watch.silent(1e9) == ""


def test_an_owner_whose_time_waits_for_its_controllers_misses_nobody(clock):
    owner = Controlled()
    watch = SetpointWatch(owner, lambda role: 5)
    owner.said()
    watch.rest()
    assert after(watch, clock, 60.0) == ""
