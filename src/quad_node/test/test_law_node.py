"""A node that runs a law: what is not finite is not sent, and parameters change live only where that is safe."""

import math
from types import SimpleNamespace

import pytest
import yaml
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message

from quad_core.types import Actuation, AttitudeThrust, PositionInputs, Quat, TrajectoryPoint, Vec3, VehicleState
from quad_msgs.msg import PositionInternals
from quad_node.codec import Stamped
from quad_node.law_node import LawNode
from quad_node.responder import Sample
from quad_position_ctrl import aibs

SAMPLE = Sample(7, 14_000_000, VehicleState(Vec3(), Vec3(), Quat(), Vec3()), 0.01)


@pytest.fixture
def node(start_node):
    return start_node(lambda: LawNode("position_controller"), "aibs.x.position_gain:=3.5")


@pytest.fixture
def seen(node):
    """Return what the law of ``node`` was called with: (gain, memory, inputs, dt) of each step."""
    calls = []

    def step(parameters, vehicle, memory, inputs, dt):
        calls.append((parameters.x.position_gain, memory, inputs, dt))
        law = aibs.Memory(velocity=Vec3(float(len(calls)), 0.0, 0.0))
        return AttitudeThrust(thrust=4.0), memory._replace(law=law), aibs.Internals(lyapunov=9.0)

    node.compute = step
    return calls


def test_the_law_gets_parameters_memory_inputs_and_time_and_its_answer_is_sent(node, seen):
    for _ in range(2):
        answers = list(node.step(SAMPLE, [None, None]))
    gain, memory, inputs, dt = seen[1]
    assert (gain, memory.law.velocity.x, inputs.state, dt) == (3.5, 1.0, SAMPLE.state, 0.01)
    (setpoint, _), (internals, payload) = answers
    assert setpoint.topic_name.endswith("/attitude_setpoint")
    assert internals.topic_name.endswith("/position_controller/internals")
    message = deserialize_message(payload, PositionInternals)
    assert (message.step, message.stamp.nanosec, message.lyapunov) == (7, 14_000_000, 9.0)
    assert not node.node.done.done()


def test_inputs_stand_in_the_order_of_the_table(node, seen):
    reference, actuation = TrajectoryPoint(yaw=0.5), Actuation(thrust=3.0)
    arrivals = [Stamped(5, 10, 0, reference, True), Stamped(6, 7, 0, actuation, True)]
    _, (_, payload) = node.step(SAMPLE, arrivals)
    assert seen[0][2] == PositionInputs(SAMPLE.state, reference, actuation)
    message = deserialize_message(payload, PositionInternals)
    assert message.input_steps.tolist() == [5, 6, -1, -1]
    assert (message.dt, message.replaced_inputs, message.lyapunov) == (0.01, 0, 9.0)


def test_an_input_that_is_too_old_in_real_time_is_replaced_and_the_answer_says_so(node, seen):
    node.node.lockstep = False
    moving = TrajectoryPoint(p_w=Vec3(1.0, 2.0, 3.0), v_w=Vec3(4.0, 0.0, 0.0), yaw=0.5)
    _, (_, payload) = node.step(SAMPLE, [Stamped(5, 10, 0, moving, True), None])
    flown = seen[0][2].reference
    assert (flown.p_w, flown.v_w, flown.yaw) == (moving.p_w, Vec3(), 0.5)
    message = deserialize_message(payload, PositionInternals)
    assert (message.input_steps.tolist(), message.replaced_inputs) == ([5, -1, -1, -1], 1)


@pytest.mark.parametrize(("output", "memory"), [
    (AttitudeThrust(thrust=math.nan), aibs.Memory()),
    (AttitudeThrust(thrust=1.0), aibs.Memory(velocity=Vec3(math.inf, 0.0, 0.0))),
])  # fmt: skip
def test_a_number_that_is_not_finite_ends_the_flight_and_is_not_sent(node, output, memory):
    before = node.memory
    node.compute = lambda *_: (output, before._replace(law=memory), aibs.Internals())
    assert list(node.step(SAMPLE, [None, None])) == []
    assert node.memory == before
    assert (node.node.done.done(), node.node.exit_code, node.node.events.counts["law_nonfinite"]) == (True, 1, 1)


def outcome(node, name, value):
    (result,) = node.node.ros.set_parameters([Parameter(name, value=value)])
    return result


def test_what_is_published_and_recorded_of_a_live_change_is_what_the_law_runs_with(node):
    sent = []
    node.node._parameters_out = SimpleNamespace(publish=sent.append)
    node.responder._due = 15
    assert outcome(node, "aibs.x.position_gain", 2.5).successful
    assert not outcome(node, "aibs.x.position_gain", 1e6).successful
    (message,) = sent  # a change that is refused publishes nothing
    recorded = yaml.safe_load(message.parameters)["/position_controller"]["ros__parameters"]
    assert recorded["aibs.x.position_gain"] == 2.5 == node.node.resolved.law.parameters.x.position_gain
    assert message.step == 15


@pytest.mark.parametrize(("name", "value", "word"), [
    ("aibs.x.position_gain", 1e6, "aibs.x.position_gain"),
    ("aibs.x.position_gain", math.nan, "aibs.x.position_gain"),
    ("period_steps", 2, "read"),
    ("vehicle.mass", 0.9, "read"),
    ("aibs.thrust_form", "norm", "read"),
])  # fmt: skip
def test_what_is_out_of_range_or_not_live_is_refused_and_nothing_changes(node, name, value, word):
    before, law = (node.node.vehicle, node.node.period_steps), node.node.resolved
    result = outcome(node, name, value)
    assert not result.successful
    assert word in result.reason
    assert (node.node.vehicle, node.node.period_steps) == before
    assert node.node.resolved is law


@pytest.mark.parametrize("shadow", [True, False])
def test_a_shadow_alone_leaves_out_a_step_whose_input_is_past_and_joins_a_flight_under_way(start_node, shadow):
    node = start_node(lambda: LawNode("position_controller"), name="shadow_position_controller" if shadow else "")
    assert [publisher.topic_name.startswith("/shadow/") for publisher, _ in node.step(SAMPLE, [None, None])] == [
        shadow,
        shadow,
    ]
    reference, actuation = node.responder.inputs
    actuation.put(Stamped(0, 1, 0, None, True))
    assert not node.responder._leaves_out(0)  # there is none before step 0
    actuation.put(Stamped(99, 100, 0, None, True))
    reference.put(Stamped(95, 100, 0, None, True))
    assert not node.responder._leaves_out(100)  # it may be on its way
    reference.put(Stamped(105, 110, 0, None, True))
    assert node.responder._leaves_out(100) == shadow
    assert [node.responder._joins(100) for _ in range(2)] == [shadow, shadow]
    assert node.node.events.counts["came_late"] == (not shadow)
