"""Hot standby: when a controller takes over from the other one, stands by, and what both send then."""

import math
import time
import zlib

import pytest
import rclpy
from rclpy.serialization import serialize_message

from quad_core.parameters import ParameterError
from quad_core.types import Quat, Vec3, VehicleState
from quad_msgs.msg import AttitudeThrust, Takeover
from quad_node.codec import Stamped
from quad_node.responder import LawNode, Sample

SHADOW, MAIN = "shadow_position_controller", "position_controller"
ROLES = f"simulator,trajectory,position_controller,attitude_controller,recorder,{SHADOW}"
INSIDE = "position_controller/internals"
STILL = VehicleState(Vec3(), Vec3(), Quat(0.0, 0.0, 0.0, 1.0), Vec3())


@pytest.fixture
def make(start_node):
    """Return a function that makes a position controller, or its shadow, with the given ROS parameters."""

    def built(*words, shadow=True):
        given = (f"flight.roles:={ROLES}", "flight.mode:=realtime", "flight.standby:=true", *words)
        return start_node(lambda: LawNode(MAIN), *given, name=SHADOW if shadow else "")

    return built


def answered(node, step):
    """Let ``node`` answer ``step``."""
    return list(node.answer(Sample(step, step * 2_000_000, STILL, 0.01), [None, None]))


def topics_of(node, step):
    """Return on which topics the answer to ``step`` is sent."""
    return [publisher.topic_name for publisher, _ in answered(node, step)]


def heard(node, step, run=0):
    """Let the other controller have answered ``step``."""
    node.standby._on_answer(serialize_message(AttitudeThrust(step=step, run=run)))


def warm(node, begin=0, seconds=2.0):
    """Let ``node`` stand by for some time; returns the first step after it."""
    end = begin + int(seconds * 500)
    for step in range(begin, end + 1, 5):
        heard(node, step)
        assert topics_of(node, step) == ([] if node.ros.get_name() == MAIN else ASIDE)
    return end + 5


def called(node):
    """Return whether a request is accepted, and what is said."""
    response = node.standby._on_call(None, Response())
    return response.success, response.message


def told(node, role, step, memory_step=0, sender="/other", run_id=""):
    """Let a message on flight/takeover arrive."""
    message = Takeover(node=sender, role=role, step=step, memory_step=memory_step, run_id=run_id, detail="why")
    node.standby._on_takeover(message)


class Response:
    """Stands in for the response of a service."""

    success, message = False, ""


FLYING = ["/attitude_setpoint", "/position_controller/internals"]
ASIDE = ["/shadow/attitude_setpoint", "/shadow/position_controller/internals"]
BOTH = [FLYING[0], ASIDE[0], FLYING[1], ASIDE[1]]


def test_a_standby_stays_aside_while_the_other_answers(make):
    node = make()
    for step in range(5, 100, 5):
        heard(node, step - 5)
        node.standby._heard -= 1.0  # a long time without anything new, but no step is lacking
        assert topics_of(node, step) == ASIDE


def late(node, run=0):
    """Let the other controller be late in steps, and then by the clock, too."""
    heard(node, 5, run)
    node.standby._heard = math.inf  # just now, however slow this machine is
    for step in (5, 10, 15, 20, 25):
        assert topics_of(node, step) == ASIDE  # 40 ms in steps, but just heard: its own queue was long
    node.standby._heard = time.monotonic() - 0.05


def test_in_real_time_it_flies_when_the_other_is_late_in_steps_and_by_the_clock(make):
    node = make()
    late(node)
    assert topics_of(node, 30) == BOTH
    heard(node, 35)
    assert topics_of(node, 40) == BOTH  # it does not give back


@pytest.mark.parametrize(("step", "run_id", "foreign"), [(30, b"theirs", 1), (2**40, b"ours", 0)])
def test_an_answer_of_another_run_or_of_an_absurd_step_does_not_hide_silence(make, step, run_id, foreign):
    node = make("flight.run_id:=ours")
    late(node, zlib.crc32(b"ours"))
    heard(node, step, zlib.crc32(run_id))
    assert topics_of(node, 30) == BOTH
    assert node.counters["foreign_run"] == foreign


def test_in_real_time_it_flies_on_request_some_answers_later(make):
    node = make()
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


@pytest.mark.parametrize(
    ("role", "run_id", "stands_by"),
    [(SHADOW, "run", True), ("shadow_attitude_controller", "run", False), (SHADOW, "another", False)],
)
def test_who_is_replaced_stands_by(make, role, run_id, stands_by):
    node = make("flight.run_id:=run", shadow=False)
    told(node, role, 10, run_id=run_id)
    assert topics_of(node, 5) == FLYING
    assert topics_of(node, 10) == ([] if stands_by else FLYING)
    assert node.standby.flies != stands_by


def test_who_was_replaced_may_come_back_without_a_pause(make):
    node = make(shadow=False)
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


@pytest.mark.parametrize("shadow", [True, False])
def test_only_who_stands_by_leaves_out_a_step_whose_input_is_past(make, shadow):
    node = make(shadow=shadow)
    taken, actuation = node.inputs
    actuation.put(Stamped(0, 1, 0, None, True))
    assert not node.leaves_out(0)  # there is none before step 0
    actuation.put(Stamped(99, 100, 0, None, True))
    assert not node.leaves_out(100)
    taken.put(Stamped(95, 100, 0, None, True))
    assert not node.leaves_out(100)  # it may be on its way
    taken.put(Stamped(105, 110, 0, None, True))
    assert node.leaves_out(100) == shadow


@pytest.mark.parametrize("shadow", [True, False])
def test_who_comes_late_stands_by_whatever_its_role_and_flies_only_with_a_warm_memory(make, shadow):
    node = make(shadow=shadow)
    told(node, node.role, 50)  # of its former life
    assert node.comes_late(100)
    step = warm(node, 100, 1.9)
    node.standby._heard -= 1.0
    assert topics_of(node, step + 50) == (ASIDE if shadow else [])  # the other is silent, and so is this one: too cold
    assert called(node) == (False, "its memory is 0.00 s old, expected 2 s of answers without a gap")
    assert node.counters["not_warm"] == 1
    last = warm(node, step + 50) - 5
    node.standby._heard -= 1.0
    assert topics_of(node, last + 10) == (ASIDE if shadow else [])
    assert topics_of(node, last + 15) == (BOTH if shadow else FLYING)  # more than 20 ms
    assert node.standby._takeover == (last + 15, not shadow)
    told(node, MAIN if shadow else SHADOW, last + 10)
    assert topics_of(node, last + 20) == (BOTH if shadow else FLYING)


def test_who_has_heard_nothing_of_the_other_does_not_replace_it(make):
    node = make(shadow=False)
    node.comes_late(100)
    for step in range(100, 1200, 5):
        answered(node, step)
    assert called(node) == (False, "nothing heard of shadow_position_controller")


@pytest.mark.parametrize(("words", "takes_part"), [(["flight.standby:=false"], [True, False]), ([], [True, True])])
def test_without_a_standby_a_controller_that_comes_late_is_silent_and_a_shadow_computes(make, words, takes_part):
    assert make(*words).comes_late(100) == takes_part[0]
    rclpy.try_shutdown()
    node = make(*words, shadow=False)
    assert [node.comes_late(100) for _ in range(2)] == [takes_part[1]] * 2
    assert node.counters["came_late"] == (not takes_part[1])


def test_a_standby_in_lockstep_is_refused(make):
    with pytest.raises(
        ParameterError, match=r"flight\.standby: found true with flight\.mode lockstep, expected realtime"
    ):
        make("flight.mode:=lockstep")
