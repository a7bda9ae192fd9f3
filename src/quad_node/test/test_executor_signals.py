"""The executor of all nodes: it ends when it is asked to, by a callback or by a signal, and hides no exception."""

import os
import signal
import time

import pytest
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from quad_node import executor, main


@pytest.fixture
def node(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "73")
    executor.init([])
    made = Node("spun", start_parameter_services=False)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # whatever started the tests
    yield made
    for number, handler in handlers.items():
        signal.signal(number, handler)
    made.destroy_node()
    rclpy.try_shutdown()


def every(node, seconds, callback):
    return node.create_timer(seconds, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))


@pytest.mark.parametrize("kind", ["events", "single"])
def test_spin_ends_when_a_callback_says_so(node, kind):
    done, calls = Future(), []

    def call():
        calls.append(1)
        if len(calls) == 3:
            done.set_result(None)

    every(node, 0.01, call)
    executor.spin([node], done, kind)
    assert done.done()
    assert len(calls) == 3


@pytest.mark.parametrize("kind", ["events", "single"])
def test_an_exception_of_a_callback_is_not_swallowed(node, kind):
    def call():
        raise RuntimeError("broken callback")

    every(node, 0.01, call)
    with pytest.raises(RuntimeError, match="broken callback"):
        executor.spin([node], Future(), kind)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_the_spinning_and_is_named(node, name):
    done, stop = Future(), []
    executor.on_signals(stop, done)
    every(node, 0.02, lambda: None)
    once = every(node, 0.03, lambda: (once.cancel(), os.kill(os.getpid(), getattr(signal, name))))
    executor.spin([node], done)
    assert stop == [name]
    assert rclpy.ok(), "the node must still be able to say goodbye"


def test_a_hang_up_that_is_ignored_from_the_start_ends_nothing(node):
    """nohup has it ignored."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    done, stop = Future(), []
    executor.on_signals(stop, done)
    os.kill(os.getpid(), signal.SIGHUP)
    assert not done.done()
    os.kill(os.getpid(), signal.SIGTERM)
    assert stop == ["SIGTERM"]


def test_the_first_signal_may_be_asked_to_wait_but_not_one_that_comes_later(node, monkeypatch):
    """Of one Ctrl-C come two signals, of a terminal that goes three: none of them asks for motors off."""
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    done, stop = Future(), []
    executor.on_signals(stop, done, lambda _: True)
    for number, wait in ((signal.SIGINT, 0.4), (signal.SIGTERM, 0.4), (signal.SIGHUP, 0.4)):
        os.kill(os.getpid(), number)
        now[0] += wait
    assert (stop, done.done()) == (["SIGINT"], False)
    os.kill(os.getpid(), signal.SIGTERM)
    assert (stop, done.done()) == (["SIGINT", "SIGTERM"], True)


def test_a_second_signal_is_noted_and_does_no_harm(node):
    done, stop = Future(), []
    executor.on_signals(stop, done)
    os.kill(os.getpid(), signal.SIGINT)
    os.kill(os.getpid(), signal.SIGTERM)
    assert sorted(stop) == ["SIGINT", "SIGTERM"]


def test_the_plain_executor_can_be_asked_for(node):
    assert isinstance(executor.make_executor("single"), SingleThreadedExecutor)


class Opened:
    """Stands in for a node that opened a file while it was made."""

    def __init__(self):
        os.kill(os.getpid(), signal.SIGINT)
        self.done, self.said, self.exit_code, self.priority, self.in_background = Future(), [], 0, 0, False

    def scheduled(self, text):
        pass

    def on_signal(self, name):
        return False

    def on_interrupt(self, name):
        self.said.append(name)
        self.exit_code = 1

    def drain(self, patience):
        self.said.append("drained")

    def close(self):
        self.said.append("closed")


def test_a_signal_while_the_node_is_made_still_closes_what_it_opened(monkeypatch):
    made = []
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    monkeypatch.setattr(executor, "spin", lambda nodes, done: made.append((nodes[0], done.done())))
    monkeypatch.setattr(main.shutdown, "destroy", lambda node, code: None)
    try:
        assert main._spin("recorder", Opened) == 1
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    [(node, was_done)] = made
    assert was_done
    assert node.said == ["SIGINT", "drained", "closed"]
