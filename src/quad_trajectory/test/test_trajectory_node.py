"""The trajectory node: a start from which no plan keeps its limits ends the flight with the reason."""

import math
from functools import partial
from types import SimpleNamespace

import pytest
from rclpy.serialization import serialize_message

from quad_core.types import Quat, TrajectoryPoint, Vec3, VehicleState
from quad_msgs.msg import FlightMode
from quad_node.handshake import run_number
from quad_node.responder import Sample
from quad_trajectory.node import Trajectory

ROLES = "simulator,trajectory,commander,position_controller,attitude_controller,recorder"
SAMPLE = Sample(0, 0, VehicleState(Vec3(), Vec3(), Quat(), Vec3()), 0.01)


@pytest.fixture
def make(start_node, callbacks):
    """Return a function that makes the node with the given ROS parameters; its topics are functions."""
    return partial(start_node, Trajectory)


@pytest.fixture
def node(make):
    return make()


def refusing(parameters, vehicle, start):
    raise ValueError("too steep")


def test_a_plan_that_is_refused_is_an_event_and_ends_the_node(node):
    node._plugin = node._plugin._replace(module=SimpleNamespace(plan=refusing))
    assert list(node.step(SAMPLE, [])) == []
    assert (node.node.done.done(), node.node.exit_code, node.node.events.counts["plan_refused"]) == (True, 1, 1)


@pytest.mark.parametrize(("kind", "steps"), [("plan_refused", 0), ("reference_nonfinite", 1)])
def test_a_reference_that_is_not_finite_is_not_published(node, kind, steps):
    good = [len(list(node.step(SAMPLE, []))) for _ in range(steps)]
    broken = {**vars(node._plugin.module), "sample": lambda *_: TrajectoryPoint(yaw=math.nan)}
    node._plugin = node._plugin._replace(module=SimpleNamespace(**broken))
    assert list(node.step(SAMPLE._replace(step=5, stamp_ns=10_000_000), [])) == []
    assert (good, node.node.done.done(), node.node.exit_code, node.node.events.counts[kind]) == (
        [2] * steps,
        True,
        1,
        1,
    )


def test_the_plan_comes_before_the_first_reference_and_once(node):
    first = [publisher.topic_name for publisher, _ in node.step(SAMPLE, [])]
    second = [publisher.topic_name for publisher, _ in node.step(SAMPLE._replace(step=5, stamp_ns=10_000_000), [])]
    assert (first, second) == (["/flight/plan", "/reference"], ["/reference"])


@pytest.mark.parametrize("commanded", [False, True])
def test_an_estimate_that_moves_on_the_ground_is_left_to_the_commander_where_there_is_one(make, commanded):
    node = make(f"flight.roles:={ROLES}") if commanded else make()
    moves = SAMPLE.state._replace(v_w=Vec3(0.2, 0.0, 0.0), on_ground=True)
    sent = list(node.step(SAMPLE._replace(state=moves), [None, None]))
    assert node.node.done.done() is (not commanded)
    assert len(sent) == (2 if commanded else 0)


@pytest.mark.parametrize("run_id", ["", "b2"])
def test_the_mode_of_another_run_or_of_none_is_not_obeyed(make, callbacks, run_id):
    node = make(f"flight.roles:={ROLES}", "flight.run_id:=a1")
    taken = node.responder.inputs[0]
    for name in ("a1", run_id):
        mode = FlightMode(
            mode=FlightMode.MISSION if name == "a1" else FlightMode.DISARMED, next_step=5, run=run_number(name)
        )
        callbacks["flight/mode"](serialize_message(mode))
    assert taken.newest.value.mode == FlightMode.MISSION
    assert node.node.events.counts["foreign_run"] == 1
