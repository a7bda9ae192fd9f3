"""Real time without a commander: a position controller that is silent is noticed by whoever owns the vehicle."""

import zlib
from types import SimpleNamespace

import pytest
from rclpy.serialization import serialize_message

from quad_core.cascade import ROLES
from quad_core.flight_parameters import FlightParameters
from quad_msgs.msg import AttitudeThrust, TrajectoryPoint
from quad_node import setpoint_watch
from quad_node.setpoint_watch import SetpointWatch

OURS = zlib.crc32(b"ours")


class Owner:
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
    monkeypatch.setattr(setpoint_watch.time, "monotonic", lambda: found.now)
    return found


def after(watch, clock, seconds, has_states=True):
    """Return what the watch says after some time in which its owner published states and looked every 50 ms."""
    said, asked_at = "", clock.now
    for _ in range(round(seconds / 0.05)):
        clock.now += 0.05
        said = said or watch.silent(clock.now if has_states else asked_at)
    return said


def test_a_silent_position_controller_is_named_after_its_time(clock):
    owner = Owner()
    watch = SetpointWatch(owner, lambda role: 5)
    assert after(watch, clock, 5.0) == ""  # nothing has come yet: the handshake waits for it
    owner.said()
    assert after(watch, clock, 0.3) == ""
    assert after(watch, clock, 0.1) == "position_controller does not answer: attitude_setpoint older than 0.3 s"


def test_a_silent_trajectory_is_named_after_its_time(clock):
    owner = Owner()
    watch = SetpointWatch(owner, lambda role: 5)
    owner.callbacks["reference"](serialize_message(TrajectoryPoint(run=OURS)))
    assert after(watch, clock, 2.0) == ""
    assert after(watch, clock, 0.1) == "trajectory does not answer: reference older than 2 s"
    commanded = Owner(commanded=True)
    SetpointWatch(commanded, lambda role: 5)
    assert commanded.callbacks == {}, "the commander decides"


def test_a_controller_that_gets_no_states_has_nothing_to_answer(clock):
    owner = Owner()
    watch = SetpointWatch(owner, lambda role: 5)
    assert after(watch, clock, 0.1) == ""
    owner.said()
    assert after(watch, clock, 60.0, has_states=False) == ""
    assert after(watch, clock, 0.5)


def test_setpoints_of_another_run_are_none(clock):
    owner = Owner()
    watch = SetpointWatch(owner, lambda role: 5)
    owner.said()
    for _ in range(8):
        owner.said(run=0)
        said = after(watch, clock, 0.05)
    assert said


def test_a_slow_controller_may_take_three_of_its_periods(clock):
    owner = Owner()
    watch = SetpointWatch(owner, lambda role: 250)  # 0.5 s
    owner.said()
    assert after(watch, clock, 1.45) == ""
    assert after(watch, clock, 0.15)


def test_an_owner_that_slept_holds_it_against_nobody(clock):
    owner = Owner()
    watch = SetpointWatch(owner, lambda role: 5)
    owner.said()
    assert after(watch, clock, 0.1) == ""
    clock.now += 5.0
    assert watch.silent(clock.now) == ""
    owner.said()
    assert after(watch, clock, 0.3) == ""


@pytest.mark.parametrize(
    "owner", [Owner(lockstep=True), Owner(commanded=True), Owner(roles=("simulator", "attitude_controller"))]
)
def test_where_another_decides_or_nobody_sends_it_nothing_is_watched(owner):
    watch = SetpointWatch(owner, lambda role: 5)
    assert not owner.callbacks
    assert watch.silent(1e9) == ""


def test_an_owner_whose_time_waits_for_its_controllers_misses_nobody(clock):
    owner = Owner()
    watch = SetpointWatch(owner, lambda role: 5)
    owner.said()
    watch.rest()
    assert after(watch, clock, 60.0) == ""
