"""What `command` does where the commander is known and listens, but is not heard."""

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

from quad_commander import command
from quad_commander.mode_table import Request
from quad_msgs.msg import FlightMode
from quad_node import executor, topics


@pytest.fixture
def flight(monkeypatch):
    """Return a function that asks a commander; it gives exit code, line, what was asked and where `command` joined."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "75")
    monkeypatch.setattr(command, "_FIRST", 0.5)
    executor.init([])
    node = rclpy.create_node("commander")
    asked = []
    modes = node.create_publisher(FlightMode, "flight/mode", topics.TOPICS["flight/mode"].qos())
    entry = topics.TOPICS["flight/request"]

    def ask(request, answers):
        def on_request(message):
            asked.append(Request(message.request))
            if answers:
                modes.publish(FlightMode(sender=message.sender, name="LAND", answer=FlightMode.DONE))

        node.create_subscription(entry.type, entry.name, on_request, entry.qos())
        if answers:
            modes.publish(FlightMode(name="HOLD"))
        turning = SingleThreadedExecutor()
        turning.add_node(node)
        monkeypatch.setattr(command.rclpy, "spin_once", spun_with(turning))
        code, line = command.ask(request, "", 3.0)
        return code, line, asked, places

    places = []
    joined = command.Asker

    def join(*words, at_the_end=False):
        places.append("at the end" if at_the_end else "first free")
        return joined(*words, at_the_end=at_the_end)

    monkeypatch.setattr(command, "Asker", join)
    yield ask
    node.destroy_node()
    rclpy.try_shutdown()


def spun_with(turning):
    """Return rclpy.spin_once for one process in which the commander of the test lives, too."""
    own = {}

    def spin_once(node, timeout_sec):
        if node not in own:
            own[node] = SingleThreadedExecutor()
            own[node].add_node(node)
        turning.spin_once(timeout_sec=0.0)
        own[node].spin_once(timeout_sec=timeout_sec)

    return spin_once


def test_a_commander_that_is_heard_is_asked_once(flight):
    code, _, asked, places = flight(Request.LAND, answers=True)
    assert (code, asked, places) == (command.DONE, [Request.LAND], ["first free"])


@pytest.mark.parametrize(("request_", "times"), [(Request.LAND, 1), (Request.KILL, 2)])
def test_one_that_is_mute_is_asked_from_another_place_and_the_answer_is_missed(flight, request_, times):
    """KILL goes out from the first place, too: nothing waits for an answer there."""
    code, line, asked, places = flight(request_, answers=False)
    assert (code, line) == (command.NO_ANSWER, "flight/mode: found no answer within 3 s, expected one")
    assert asked == [request_] * times
    assert places == ["first free", "at the end"]
