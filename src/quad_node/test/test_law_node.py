"""A node that runs a law: what is not finite is not sent, and parameters change live only where that is safe."""

import itertools
import math
import types

import pytest
import rclpy
import yaml
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message

from quad_core.types import Actuation, AttitudeThrust, PositionInputs, Quat, TrajectoryPoint, Vec3, VehicleState
from quad_flight import flight
from quad_msgs.msg import PositionInternals
from quad_node import executor
from quad_node.responder import Arrival, LawNode, Sample
from quad_position_ctrl import aibs

SAMPLE = Sample(7, 14_000_000, VehicleState(Vec3(), Vec3(), Quat(), Vec3()), 0.01)


class Wire:
    """Stands in for a publisher and keeps what was sent."""

    def __init__(self):
        self.sent = []

    def publish(self, message):
        self.sent.append(message)


@pytest.fixture
def node(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "72")
    executor.init(["--ros-args", "-p", "aibs.x.position_gain:=3.5"])
    made = LawNode("position_controller")
    yield made
    made.ros.destroy_node()
    rclpy.try_shutdown()


@pytest.fixture
def seen(node):
    """Return what the law of ``node`` was called with: (gain, memory, inputs, dt) of each step."""
    calls = []

    def step(parameters, vehicle, memory, inputs, dt):
        calls.append((parameters.x.position_gain, memory, inputs, dt))
        law = aibs.Memory(velocity=Vec3(float(len(calls)), 0.0, 0.0))
        return AttitudeThrust(thrust=4.0), memory._replace(law=law), aibs.Internals(lyapunov=9.0)

    node.step = step
    return calls


def test_the_law_gets_parameters_memory_inputs_and_time_and_its_answer_is_sent(node, seen):
    for _ in range(2):
        answers = list(node.answer(SAMPLE, [None, None]))
    gain, memory, inputs, dt = seen[1]
    assert (gain, memory.law.velocity.x, inputs.state, dt) == (3.5, 1.0, SAMPLE.state, 0.01)
    (setpoint, _), (internals, payload) = answers
    assert setpoint.topic_name.endswith("/attitude_setpoint")
    assert internals.topic_name.endswith("/position_controller/internals")
    message = deserialize_message(payload, PositionInternals)
    assert (message.step, message.stamp.nanosec, message.lyapunov) == (7, 14_000_000, 9.0)
    assert not node.done.done()


def test_inputs_stand_in_the_order_of_the_table(node, seen):
    reference, actuation = TrajectoryPoint(yaw=0.5), Actuation(thrust=3.0)
    arrivals = [Arrival(5, 10, reference, math.inf), Arrival(6, 7, actuation, math.inf)]
    _, (_, payload) = node.answer(SAMPLE, arrivals)
    assert seen[0][2] == PositionInputs(SAMPLE.state, reference, actuation)
    message = deserialize_message(payload, PositionInternals)
    assert message.input_steps.tolist() == [5, 6, -1, -1]
    assert (message.dt, message.replaced_inputs, message.lyapunov) == (0.01, 0, 9.0)


def test_an_input_that_is_too_old_in_real_time_is_replaced_and_the_answer_says_so(node, seen):
    node.lockstep = False
    moving = TrajectoryPoint(p_w=Vec3(1.0, 2.0, 3.0), v_w=Vec3(4.0, 0.0, 0.0), yaw=0.5)
    _, (_, payload) = node.answer(SAMPLE, [Arrival(5, 10, moving, -math.inf), None])
    flown = seen[0][2].reference
    assert (flown.p_w, flown.v_w, flown.yaw) == (moving.p_w, Vec3(), 0.5)
    message = deserialize_message(payload, PositionInternals)
    assert (message.input_steps.tolist(), message.replaced_inputs) == ([5, -1, -1, -1], 1)


@pytest.mark.parametrize(
    ("output", "memory"),
    [
        (AttitudeThrust(thrust=math.nan), aibs.Memory()),
        (AttitudeThrust(thrust=1.0), aibs.Memory(velocity=Vec3(math.inf, 0.0, 0.0))),
    ],
)
def test_a_number_that_is_not_finite_ends_the_flight_and_is_not_sent(node, output, memory):
    before = node.memory
    node.step = lambda *_: (output, before._replace(law=memory), aibs.Internals())
    assert list(node.answer(SAMPLE, [None, None])) == []
    assert node.memory == before
    assert (node.done.done(), node.exit_code, node.counters["law_nonfinite"]) == (True, 1, 1)


def remembering_infinity(step, at_call):
    """Return ``step`` whose law's memory is no longer finite at a call; what it gives stays finite."""
    calls = itertools.count(1)

    def stepped(*arguments):
        setpoint, memory, internals = step(*arguments)
        if next(calls) == at_call:
            own = getattr(memory, "law", memory)._replace(velocity=Vec3(math.inf, 0.0, 0.0))
            memory = memory._replace(law=own) if hasattr(memory, "law") else own
        return setpoint, memory, internals

    return stepped


def test_memory_that_is_not_finite_is_refused_at_the_step_at_which_the_loop_refuses_it(node):
    planned = flight.from_names("hover", duration=0.1)
    law = types.ModuleType("law_of_this_test")
    vars(law).update({**vars(aibs), "step": remembering_infinity(aibs.step, at_call=4)})
    modules = planned.modules._replace(stages=planned.modules.stages._replace(position_controller=law))
    flown = flight.fly(planned._replace(modules=modules))
    assert (flown.outcome, flown.refused, flown.steps) == ("refused", "position_controller", 3 * node.period_steps)
    node.step = remembering_infinity(node.step, at_call=4)
    steps = iter(range(0, 100 * node.period_steps, node.period_steps))
    while not node.done.done():
        step = next(steps)
        list(node.answer(SAMPLE._replace(step=step), [None, None]))
    assert step == flown.steps


def outcome(node, name, value):
    (result,) = node.ros.set_parameters([Parameter(name, value=value)])
    return result


def test_what_is_published_and_recorded_of_a_live_change_is_what_the_law_runs_with(node):
    node._parameters_out = wire = Wire()
    node._due = 15
    assert outcome(node, "aibs.x.position_gain", 2.5).successful
    assert not outcome(node, "aibs.x.position_gain", 1e6).successful
    (message,) = wire.sent  # a change that is refused publishes nothing
    recorded = yaml.safe_load(message.parameters)["/position_controller"]["ros__parameters"]
    assert recorded["aibs.x.position_gain"] == 2.5 == node.law.parameters.x.position_gain
    assert message.step == 15


@pytest.mark.parametrize(
    ("name", "value", "word"),
    [
        ("aibs.x.position_gain", 1e6, "aibs.x.position_gain"),
        ("aibs.x.position_gain", math.nan, "aibs.x.position_gain"),
        ("period_steps", 2, "read"),
        ("vehicle.mass", 0.9, "read"),
        ("aibs.thrust_form", "norm", "read"),
    ],
)
def test_what_is_out_of_range_or_not_live_is_refused_and_nothing_changes(node, name, value, word):
    before, law = (node.vehicle, node.period_steps), node.law
    result = outcome(node, name, value)
    assert not result.successful
    assert word in result.reason
    assert (node.vehicle, node.period_steps) == before
    assert node.law is law
