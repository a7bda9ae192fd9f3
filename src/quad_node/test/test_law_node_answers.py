"""A node that runs a law: what is not finite is not sent, and parameters change live only where that is safe."""

import math
from types import SimpleNamespace

import pytest
import rclpy
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message

from quad_core import plugins, programs
from quad_core.program import Interpreted
from quad_core.types import Quat, Vec3, VehicleState, Wrench
from quad_msgs.msg import PositionInternals
from quad_node import executor
from quad_node.law_node import LawNode
from quad_node.responder import Moment
from quad_position_ctrl import aibs

MOMENT = Moment(7, 14_000_000, VehicleState(Vec3(), Vec3(), Quat(), Vec3()), 0.01)


@pytest.fixture
def node(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "72")
    executor.init(["--ros-args", "-p", "aibs.x.position_gain:=3.5"])
    made = LawNode("position_controller", PositionInternals)
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


def with_law(node, step):
    """Let ``node`` run ``step`` in the place of its law, on the values that it has."""
    names = ("Parameters", "Memory", "Internals")
    law = SimpleNamespace(__name__="law", step=step, **{name: getattr(aibs, name) for name in names})
    before, node._stepper = node._stepper, Interpreted(programs.law(plugins.POSITION_LAW, law))
    for name in ("parameters", "vehicle", "memory"):
        node._stepper.put(name, before.get(name))


def test_memory_and_internals_are_those_of_the_step(node):
    seen = []

    def step(parameters, vehicle, memory, inputs, dt):
        seen.append((parameters.x.position_gain, memory, inputs, dt))
        return Wrench(4.0), aibs.Memory(thrust=len(seen)), aibs.Internals(lyapunov=9.0)

    with_law(node, step)
    assert node.run_law("inputs", MOMENT) == Wrench(4.0)
    assert node.run_law("inputs", MOMENT) == Wrench(4.0)
    gain, memory, inputs, dt = seen[1]
    assert (gain, memory.thrust, inputs, dt) == (3.5, 1, "inputs", 0.01)
    _, payload = node.internals_answer(MOMENT)
    message = deserialize_message(payload, PositionInternals)
    assert (message.step, message.stamp.nanosec, message.lyapunov) == (7, 14_000_000, 9.0)
    assert not node.done.done()


@pytest.mark.parametrize(
    ("output", "memory"), [(Wrench(math.nan), aibs.Memory()), (Wrench(1.0), aibs.Memory(thrust=math.inf))]
)
def test_a_number_that_is_not_finite_ends_the_flight_and_is_not_sent(node, output, memory):
    with_law(node, lambda *_: (output, memory, aibs.Internals()))
    before = node._stepper.get("memory")
    assert node.run_law("inputs", MOMENT) is None
    assert node._stepper.get("memory") == before
    assert (node.done.done(), node.exit_code, node.counters["law_nonfinite"]) == (True, 1, 1)


def outcome(node, name, value):
    (result,) = node.set_parameters([Parameter(name, value=value)])
    return result


def test_a_gain_changes_live_and_reaches_the_law(node):
    assert outcome(node, "aibs.x.position_gain", 2.5).successful
    assert node.resolved.plugins["law"].parameters.x.position_gain == 2.5
    assert node._stepper.get("parameters").x.position_gain == 2.5


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
    before = node.law.parameters, node.vehicle, node.period_steps
    result = outcome(node, name, value)
    assert not result.successful
    assert word in result.reason
    assert (node.law.parameters, node.vehicle, node.period_steps) == before
