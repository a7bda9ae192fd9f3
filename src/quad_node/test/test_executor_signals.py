"""The executor of all nodes: it ends when it is told, by a callback or by a signal, and hides no exception."""

import os
import signal

import pytest
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from quad_node import executor


@pytest.fixture
def node(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "73")
    executor.init([])
    made = Node("spun", start_parameter_services=False)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
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


def test_a_second_signal_is_noted_and_does_no_harm(node):
    done, stop = Future(), []
    executor.on_signals(stop, done)
    os.kill(os.getpid(), signal.SIGINT)
    os.kill(os.getpid(), signal.SIGTERM)
    assert sorted(stop) == ["SIGINT", "SIGTERM"]


def test_the_plain_executor_can_be_asked_for(node):
    assert isinstance(executor.make_executor("single"), SingleThreadedExecutor)
