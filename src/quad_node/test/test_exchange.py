"""Who of two controllers is obeyed: when a standby takes over, and what both send then."""

import time

import pytest
import rclpy
from rclpy.serialization import serialize_message

from quad_core.types import Quat, Vec3, VehicleState
from quad_msgs.msg import AttitudeThrust, NodeStatus
from quad_node import executor
from quad_node.law_node import LawNode
from quad_node.responder import Sample

ROLES = "simulator,trajectory,position_controller,attitude_controller,recorder,shadow_position_controller"
INSIDE = "position_controller/internals"
STILL = VehicleState(Vec3(), Vec3(), Quat(0.0, 0.0, 0.0, 1.0), Vec3())


@pytest.fixture
def make(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "71")
    nodes = []

    def built(*words, shadow=True):
        name = ["-r", "__node:=shadow_position_controller"] if shadow else []
        given = [word for each in (f"flight.roles:={ROLES}", "flight.standby:=true", *words) for word in ("-p", each)]
        executor.init(["--ros-args", *name, *given])
        nodes.append(LawNode("position_controller"))
        return nodes[-1]

    yield built
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def topics_of(node, step):
    """Return on which topics the answer to ``step`` is sent."""
    sample = Sample(step, step * 2_000_000, STILL, 0.01)
    return [publisher.topic_name for publisher, _ in node.answer(sample, [None, None])]


def heard(node, step, topics=("attitude_setpoint", INSIDE)):
    """Let the other controller have answered ``step``."""
    message = AttitudeThrust(step=step)
    message.stamp.nanosec = step * 2_000_000
    for topic in topics:
        node.exchange._hears(topic)(serialize_message(message))


class Response:
    """Stands in for the response of a service."""

    success, message = False, ""


ASIDE = ["/shadow/attitude_setpoint", "/shadow/position_controller/internals"]
BOTH = ["/attitude_setpoint", ASIDE[0], "/position_controller/internals", ASIDE[1]]


def test_a_standby_stays_aside_while_the_other_answers(make):
    node = make("flight.mode:=realtime")
    for step in range(5, 100, 5):
        heard(node, step - 5)
        node.exchange._heard -= 1.0  # a long time without anything new, but no step is lacking
        assert topics_of(node, step) == ASIDE


def test_in_real_time_it_flies_when_the_other_is_late_in_steps_and_by_the_clock(make):
    node = make("flight.mode:=realtime")
    heard(node, 5)
    assert topics_of(node, 25) == ASIDE  # 40 ms in steps, but just heard: its own queue was long
    node.exchange._heard = time.monotonic() - 0.05
    assert topics_of(node, 30) == BOTH
    heard(node, 35)
    assert topics_of(node, 40) == BOTH  # it does not give back


def test_in_lockstep_it_flies_when_the_plant_asks_again(make):
    node = make()
    heard(node, 0)
    sample = Sample(5, 10_000_000, STILL, 0.01)
    node.answers = list(node.answer(sample, [None, None]))
    node.on_repeat(5)
    assert [publisher.topic_name for publisher, _ in node.answers] == ASIDE
    node.on_repeat(5)
    found = {publisher.topic_name: bytes(message) for publisher, message in node.answers}
    assert set(found) == set(BOTH)
    assert found["/attitude_setpoint"] == found["/shadow/attitude_setpoint"]


def test_in_lockstep_it_sends_what_the_other_sent_last_and_what_it_did_not_get_out(make):
    node = make()
    heard(node, 5)
    heard(node, 10, ["attitude_setpoint"])  # killed between its two messages
    for step in (5, 10, 15):
        node.answers = list(node.answer(Sample(step, step * 2_000_000, STILL, 0.01), [None, None]))
    node.on_repeat(15)
    node.on_repeat(15)
    sent = [(publisher.topic_name, node.exchange._step_of(message)) for publisher, message in node.answers]
    assert sent == [
        ("/attitude_setpoint", 5),  # who died in the middle of sending has reached some readers only
        ("/attitude_setpoint", 10),
        ("/position_controller/internals", 5),
        ("/position_controller/internals", 10),
        ("/attitude_setpoint", 15),
        ("/position_controller/internals", 15),
        (ASIDE[0], 15),
        (ASIDE[1], 15),
    ]


@pytest.mark.parametrize("alive", [True, False])
def test_in_lockstep_an_answer_that_reached_the_shadow_alone_is_sent_for_all(make, alive):
    node = make()
    node.answers = list(node.answer(Sample(5, 10_000_000, STILL, 0.01), [None, None]))
    heard(node, 5)
    for _ in range(10):
        assert len(node.answers) == len(ASIDE)
        node.on_repeat(5)
        if alive:
            heard(node, 5)
    assert (len(node.answers) == len(ASIDE)) == alive


def test_it_flies_on_request(make):
    node = make()
    response = node.exchange._on_call(None, Response())
    assert response.success
    # said 20 answers of 5 steps ahead, so that the other can stop in time
    assert topics_of(node, 5) == ASIDE
    assert topics_of(node, 100) == ASIDE
    assert topics_of(node, 105) == BOTH
    assert not node.exchange._on_call(None, Response()).success


@pytest.mark.parametrize(
    ("role", "run_id", "silent"),
    [
        ("shadow_position_controller", "run", True),
        ("shadow_attitude_controller", "run", False),
        ("shadow_position_controller", "another", False),
    ],
)
def test_who_is_replaced_is_silent(make, role, run_id, silent):
    node = make("flight.run_id:=run", shadow=False)
    node.exchange._on_takeover(NodeStatus(role=role, run_id=run_id, step=10))
    node.answers = [("publisher", b"")]
    node.on_repeat(5)
    assert node.answers
    assert topics_of(node, 5) == ["/attitude_setpoint", "/position_controller/internals"]
    node.on_repeat(10)
    assert bool(node.answers) != silent
    assert topics_of(node, 10) == ([] if silent else ["/attitude_setpoint", "/position_controller/internals"])


@pytest.mark.parametrize(("standby", "found"), [("true", {"attitude_setpoint", INSIDE}), ("false", set())])
def test_two_senders_are_right_only_where_one_stands_by(make, standby, found):
    assert set(make(f"flight.standby:={standby}").standby_topics) == found
