"""The trajectory node: a start from which no plan keeps its limits ends the flight with the reason."""

from types import SimpleNamespace

import pytest
import rclpy

from quad_core.types import Quat, Vec3, VehicleState
from quad_node import executor
from quad_node.responder import Sample
from quad_trajectory.node import Trajectory

SAMPLE = Sample(0, 0, VehicleState(Vec3(), Vec3(), Quat(), Vec3()), 0.01)


@pytest.fixture
def node(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "73")
    executor.init([])
    made = Trajectory()
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


def refusing(parameters, vehicle, start):
    raise ValueError("too steep")


def test_a_plan_that_is_refused_is_an_event_and_ends_the_node(node):
    node._plugin = node._plugin._replace(module=SimpleNamespace(plan=refusing))
    assert list(node.answer(SAMPLE, [])) == []
    assert (node.done.done(), node.exit_code, node.counters["plan_refused"]) == (True, 1, 1)


def test_the_plan_comes_before_the_first_reference_and_once(node):
    first = [publisher.topic_name for publisher, _ in node.answer(SAMPLE, [])]
    second = [publisher.topic_name for publisher, _ in node.answer(SAMPLE._replace(step=5, stamp_ns=10_000_000), [])]
    assert (first, second) == (["/flight/plan", "/reference"], ["/reference"])
