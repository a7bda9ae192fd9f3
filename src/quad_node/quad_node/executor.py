"""The executor of all nodes, and how a process ends."""

import signal
from types import FrameType

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

# Without a finite timeout the EventsExecutor of the rclpy wheels hangs; a day is longer than any flight.
SPIN_TIMEOUT = 86_400.0


def make_executor(kind: str = "events") -> Executor:
    """Return the EventsExecutor (half the CPU of the default one), or the single-threaded one where it is missing."""
    if kind == "events":
        try:
            from rclpy.experimental import EventsExecutor
        except ImportError:
            return SingleThreadedExecutor()
        return EventsExecutor()
    return SingleThreadedExecutor()


def spin(nodes: list[Node], done: Future, kind: str = "events") -> None:
    """Spin ``nodes`` until ``done``; returns at once when a callback or a signal handler sets it.

    A callback's exception propagates. Each node must own a periodic timer, so that signal handlers get their turn.
    """
    executor = make_executor(kind)
    for node in nodes:
        executor.add_node(node)
    while rclpy.ok() and not done.done():
        executor.spin_until_future_complete(done, timeout_sec=SPIN_TIMEOUT)
    for node in nodes:
        executor.remove_node(node)


def init(args: list[str]) -> None:
    """Initialise rclpy without its own signal handlers, so that a node can still say goodbye after SIGINT."""
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)


def on_signals(stop: "list[str]", done: Future) -> None:
    """Let SIGINT, SIGTERM and SIGHUP complete ``done``; the signal's name is appended to ``stop``."""

    def handler(number: int, _frame: FrameType | None) -> None:
        stop.append(signal.Signals(number).name)
        if not done.done():
            done.set_result(None)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, handler)
