"""What a node receives on its topics, over real middleware."""

import time
from types import SimpleNamespace

import pytest
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from quad_msgs.msg import Actuation, FlightMode
from quad_node.flight_node import FlightNode
from quad_node.topics import stream


def test_in_lockstep_a_flood_of_foreign_messages_displaces_no_message_that_waits(start_node):
    """A plant in lockstep sends each message once; a reader that keeps the last few would lose it."""
    node = start_node(lambda: FlightNode("position_controller"), "flight.mode:=lockstep")
    ours, foreign = Node("ours"), Node("foreign")
    try:
        steps = []
        node.links.subscribe("actuation", lambda message: steps.append(message.step))
        publishers = [each.create_publisher(Actuation, "actuation", stream(10)) for each in (ours, foreign)]
        executor_ = SingleThreadedExecutor()
        for each in (node.ros, ours, foreign):
            executor_.add_node(each)
        while not all(each.get_subscription_count() for each in publishers):
            executor_.spin_once(0.05)
        publishers[0].publish(Actuation(step=740))
        for _ in range(300):
            publishers[1].publish(Actuation(step=0))
            publishers[1].wait_for_all_acked(Duration(seconds=1.0))
        deadline = time.monotonic() + 5.0
        while len(steps) < 301 and time.monotonic() < deadline:
            executor_.spin_once(0.01)
        assert steps == [740] + [0] * 300
    finally:
        ours.destroy_node()
        foreign.destroy_node()


def test_a_second_sender_of_the_modes_that_the_nodes_follow_is_named(start_node):
    """Each mode travels on flight/mode/steps; nodes of a flight read nothing on flight/mode."""
    roles = "simulator,trajectory,position_controller,attitude_controller,commander"
    node = start_node(lambda: FlightNode("trajectory"), f"flight.roles:={roles}")
    ours, foreign = Node("ours"), Node("foreign")
    try:
        node.links.subscribe("flight/mode", lambda _: None)
        publishers = [each.create_publisher(FlightMode, "flight/mode/steps", stream()) for each in (ours, foreign)]
        deadline = time.monotonic() + 10.0
        while not all(each.get_subscription_count() for each in publishers) and time.monotonic() < deadline:
            time.sleep(0.02)
        expected = "one publisher of flight/mode/steps, there are 2: /foreign, /ours"
        while expected not in (found := node.missing()) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert expected in found
        assert "flight/mode/steps of commander" not in found
    finally:
        ours.destroy_node()
        foreign.destroy_node()


def test_a_node_that_stood_still_first_reads_what_came_meanwhile(start_node):
    node = start_node(lambda: FlightNode("position_controller"))
    node.flying, node.last_heard, node._ticked_at = True, node.last_heard - 30.0, node._ticked_at - 30.0
    node._tick()
    assert not node.done.done()
    node._tick()
    assert (node.done.done(), node.events.counts["simulator_lost"]) == (True, 1)


def test_a_node_that_waits_for_its_last_messages_waits_for_no_flight(start_node):
    node = start_node(lambda: FlightNode("recorder"))
    node.over, node.last_heard = True, node.last_heard - 100.0
    node._tick()
    assert (node.done.done(), node.events.counts["start_timeout"]) == (False, 0)
    node.over = False
    node._tick()
    assert (node.done.done(), node.events.counts["start_timeout"]) == (True, 1)


def test_a_node_whose_starter_and_vehicle_are_gone_waits_for_no_flight(start_node):
    node = start_node(lambda: FlightNode("recorder"))
    node.starter.pid = 2**22 + 1  # Linux gives no process such a number
    node._tick()
    assert not node.done.done()
    node.last_heard -= 3.0
    node._tick()
    assert (node.done.done(), node.exit_code) == (True, 1)


@pytest.mark.parametrize(("own", "period_steps", "in_background", "lockstep", "expected"), [
    (40, 1, False, False, 40),
    (40, 5, False, False, 39),
    (40, 1, True, False, 1),
    (40, 5, False, True, 0),
    (1, 5, False, False, 1),
    (0, 5, True, False, 0),
])  # fmt: skip
def test_a_slower_node_is_one_below_those_that_answer_every_step(own, period_steps, in_background, lockstep, expected):
    flight = SimpleNamespace(realtime_priority=own)
    node = SimpleNamespace(flight=flight, period_steps=period_steps, in_background=in_background, lockstep=lockstep)
    assert FlightNode.priority.fget(node) == expected
