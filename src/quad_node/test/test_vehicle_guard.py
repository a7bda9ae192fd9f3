"""The guard in a vehicle owner: what it publishes and reports, and how often."""

from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from quad_core.enumerations import CommandRefusal, GuardRequest
from quad_core.flight_parameters import FlightParameters
from quad_core.node_parameters import GuardParameters
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_guard.checks import StateSample, WrenchCommand
from quad_msgs.msg import GuardStatus
from quad_node.event_log import EventLog
from quad_node.vehicle_guard import VehicleGuard

pytestmark = pytest.mark.unit

PERIOD = 2_000_000
HOVER = Wrench(5.5, Vec3(0.0, 0.0, 0.0))
STATE = VehicleState(Vec3(0.0, 0.0, 2.0), Vec3(0.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0))


class Node(SimpleNamespace):
    """Keeps what it is asked to publish and to report."""

    def __init__(self):
        super().__init__(vehicle=Vehicle(), flight=FlightParameters(), run=5, links=self)
        self.said, self.told = [], []
        self.events = EventLog("/x", Mock(), SimpleNamespace(publish=self.told.append))

    def publisher(self, topic, match):
        assert (topic, match) == ("flight/guard", False)
        return SimpleNamespace(publish=self.said.append)


def made(commander=0, **changes):
    node = Node()
    return node, VehicleGuard(node, GuardParameters(**changes), lambda: commander)


def step(ours, k, wrench=HOVER, arrived=True, request=GuardRequest.NONE):
    command = WrenchCommand(wrench, k, arrived)
    state = STATE._replace(p_w=Vec3(1e-6 * k, 0.0, 2.0))
    return ours.step(k, command, StateSample(state, k, True), request)


def kinds(node):
    return [event.kind for event in node.told]


def test_a_good_wrench_passes_and_the_status_comes_ten_times_a_second():
    node, ours = made()
    for k in range(501):
        assert step(ours, k) == HOVER
    assert [(message.step, message.mode) for message in node.said] == [(k, GuardStatus.PASS) for k in range(0, 501, 50)]
    assert node.told == []
    assert (ours.taken_over, ours.describe()) == (False, "")


def test_with_a_commander_the_step_before_each_of_its_decisions_is_reported_at_rest_too():
    node, ours = made(commander=5)
    for k in range(10):
        ours.rest(k)
    for k in range(10, 30):
        step(ours, k)
    assert [message.step for message in node.said] == [0, 4, 9, 14, 19, 24, 29]
    assert not any(message.on_ground or message.mode for message in node.said)


def test_a_takeover_is_said_at_its_step_with_the_reason():
    node, ours = made()
    for k in range(40):
        step(ours, k, arrived=k < 10)
    # the last wrench is that of step 9; 50 ms are 25 steps
    changed = next(message for message in node.said if message.mode == GuardStatus.DESCEND)
    assert (changed.step, changed.since, changed.reason_text) == (35, 35, "no good wrench")
    assert changed.command_age == pytest.approx(0.052)
    assert (changed.stamp.sec, changed.stamp.nanosec, changed.run) == (0, 70_000_000, 5)
    assert kinds(node) == ["guard_descends"]
    assert ours.describe() == "guard in descend since step 35: no good wrench"


def test_the_same_refusal_is_reported_once_a_second_and_always_counted():
    node, ours = made()
    step(ours, 0)
    for k in range(1, 401):
        ours.refused(k, CommandRefusal.NOT_NEWER if k % 2 else CommandRefusal.THRUST)
        step(ours, k)
    texts = [event.text for event in node.told]
    assert texts == [
        "step 1: wrench_setpoint: not newer than the last; dropped",
        "step 2: wrench_setpoint: thrust beyond the vehicle's limits; dropped",
    ]
    assert node.events.counts["guard_refused"] == 400
    assert [message.refused_commands for message in node.said] == [message.step for message in node.said]
    assert node.said[-1].mode == GuardStatus.PASS


def test_an_absurd_wrench_is_dropped_and_named_as_the_last_refusal():
    _, ours = made()
    step(ours, 0)
    for k in range(1, 40):
        step(ours, k, wrench=Wrench(1e6, Vec3(0.0, 0.0, 0.0)))
    assert ours.taken_over
    assert ours.describe() == (
        "guard in descend since step 26: no good wrench, the last one was refused: "
        "wrench_setpoint: thrust beyond the vehicle's limits"
    )


def test_a_refusal_from_before_good_wrenches_is_no_cause_of_their_loss():
    _, ours = made()
    step(ours, 0)
    ours.refused(1, CommandRefusal.THRUST)
    for k in range(2, 200):
        step(ours, k, arrived=k < 100)
    assert ours.describe() == "guard in descend since step 125: no good wrench"


def test_a_kill_is_an_error_and_a_release_is_said():
    node, ours = made()
    step(ours, 0, request=GuardRequest.DESCEND)
    for k in range(1, 120):
        step(ours, k, request=GuardRequest.RELEASE)
    assert kinds(node) == ["guard_descends", "guard_released"]
    assert step(ours, 120, request=GuardRequest.KILL).thrust == 0.0
    assert kinds(node)[-1] == "guard_killed"


def test_a_guard_that_rests_after_a_landing_hands_nothing_back():
    node, ours = made()
    step(ours, 0, request=GuardRequest.DESCEND)
    ours.rest(1)
    assert [event.text for event in node.told[1:]] == ["step 1: the guard rests"]


def test_a_descent_names_the_node_for_which_the_flight_was_given_up():
    node, ours = made()
    step(ours, 0)
    ours.asked_because = "attitude_controller does not answer"
    step(ours, 1, request=GuardRequest.DESCEND)
    (event,) = node.told
    assert event.text.startswith("step 1: attitude_controller does not answer (wrench ")


def test_a_guard_that_is_off_looks_at_nothing():
    node, ours = made(enabled=False)
    absurd = Wrench(1e6, Vec3(0.0, 0.0, 0.0))
    assert step(ours, 0, wrench=absurd) == absurd
    assert (node.said, ours.taken_over) == ([], False)
