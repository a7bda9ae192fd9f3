"""`command` sends one request and reports the answer, or that none came."""

import math
from functools import partial

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

from quad_commander import command
from quad_commander.references import Place
from quad_commander.services import SERVICES
from quad_core.enumerations import Request
from quad_msgs.msg import FlightMode
from quad_node import executor, topics

PATIENCE = 2.0


@pytest.fixture
def commander(monkeypatch, own_domain):
    """Return a function that starts a commander in this process; it gives the list of requests that arrive."""
    executor.init([])
    node = rclpy.create_node("commander")
    modes = node.create_publisher(FlightMode, "flight/mode", topics.latched())
    requests = []

    def start(answers):
        def on_call(request, asked, response):
            requests.append((request, [*asked.p_w] if request == Request.GOTO else None))
            response.success, response.message = answers != "refuses", "why"
            if answers in ("decides", "answers another"):
                say(request if answers == "decides" else Request.HOLD, "LAND", 7)
            return response

        def say(request, name, step):
            sender, answer = f"service {request.name.lower()}", FlightMode.DONE
            modes.publish(FlightMode(sender=sender, name=name, answer=answer, request=request, request_step=step))

        say(Request.HOLD, "HOLD", 3)
        for request, kind in SERVICES.items():
            node.create_service(kind, request.name.lower(), partial(on_call, request))
        spun = SingleThreadedExecutor()
        spun.add_node(node)
        monkeypatch.setattr(command.rclpy, "spin_once", spun_with(spun))
        return requests

    yield start
    node.destroy_node()
    rclpy.try_shutdown()


def spun_with(commander):
    """Return rclpy.spin_once for a process in which the commander of the test runs, too."""
    own = {}

    def spin_once(node, timeout_sec):
        if node not in own:
            own[node] = SingleThreadedExecutor()
            own[node].add_node(node)
        commander.spin_once(timeout_sec=0.0)
        own[node].spin_once(timeout_sec=timeout_sec)

    return spin_once


@pytest.mark.parametrize(("request_", "answers", "code", "line"), [
    (Request.LAND, "decides", command.DONE, "done at step 7: the mode is LAND"),
    (Request.GOTO, "decides", command.DONE, "done at step 7: the mode is LAND"),
    (Request.LAND, "refuses", command.REFUSED, "refused: why; the mode is HOLD"),
    (Request.LAND, "answers another", command.NO_ANSWER, "flight/mode: found no answer within 2 s, expected one"),
    (Request.KILL, "is silent", command.NO_ANSWER, "flight/mode: found no answer within 2 s, expected one"),
    (Request.END, "is silent", command.DONE, "done: why"),
])  # fmt: skip
def test_a_commander_gets_one_request_and_its_answer_is_reported(commander, request_, answers, code, line):
    requests, place = commander(answers), Place(1.0, 2.0, 3.0) if request_ == Request.GOTO else None
    assert command.ask(request_, "", PATIENCE, place) == (code, line)
    assert requests == [(request_, [1.0, 2.0, 3.0] if place else None)]


@pytest.mark.parametrize(("words", "found"), [
    (["goto", "4", "0"], "goto: found '4 0', expected x y z in m"),
    (["goto", "4", "0", "two"], "goto: found '4 0 two', expected x y z in m"),
    (["goto", "4", "0", "2", "90"], "for degrees, as 90deg"),
    (["land", "2"], "land: found '2', expected nothing after it"),
    (["lnad"], "invalid choice: 'lnad'"),
])  # fmt: skip
def test_what_cannot_be_asked_for_is_refused_before_anything_starts(words, found, capsys):
    with pytest.raises(SystemExit) as ended:
        command.main(words)
    assert ended.value.code == command.NO_ANSWER
    assert found in capsys.readouterr().err


@pytest.mark.parametrize(("sender", "request_", "step", "is_ours"), [
    ("service land", Request.LAND, 7, True),
    ("service land", Request.LAND, 3, False),
    ("service hold", Request.HOLD, 7, False),
    ("service land", Request.HOLD, 7, False),
    ("pilot", Request.LAND, 7, False),
])  # fmt: skip
def test_an_answer_is_that_to_the_request_itself(sender, request_, step, is_ours):
    mode = FlightMode(sender=sender, request=request_, request_step=step)
    assert command._is_ours(mode, Request.LAND, 3) == is_ours


@pytest.mark.parametrize(("words", "place"), [
    ("4 -1 2", Place(4.0, -1.0, 2.0)),
    ("-1e1 -5. 2", Place(-10.0, -5.0, 2.0)),
    ("4 0 -.5 -90deg --patience 3", Place(4.0, 0.0, -0.5, -math.pi / 2.0)),
])  # fmt: skip
def test_a_place_is_sent_as_it_was_written(words, place, monkeypatch):
    asked = []
    monkeypatch.setattr(command, "ask", lambda *given: asked.append(given) or (command.DONE, "done"))
    with pytest.raises(SystemExit):
        command.main(["goto", *words.split()])
    assert asked[0][0] == Request.GOTO
    assert asked[0][3] == place


def test_a_flight_without_a_commander_is_named(commander):
    line = "land: found no commander in namespace 'b' within 0.5 s, expected one"
    assert command.ask(Request.LAND, "b", 0.5) == (command.NO_ANSWER, line)


def test_a_domain_that_is_none_is_no_refusal_of_the_commander(monkeypatch, capsys):
    monkeypatch.setenv("ROS_DOMAIN_ID", "300")
    with pytest.raises(SystemExit) as ended:
        command.main(["land"])
    assert ended.value.code == command.NO_ANSWER
    assert capsys.readouterr().err == "command: land: ROS_DOMAIN_ID: found 300, expected 0 to 232\n"
