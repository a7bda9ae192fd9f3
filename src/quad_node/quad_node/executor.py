"""The executor of all nodes, and how a process ends."""

import signal
import time
from collections.abc import Callable
from types import FrameType

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from quad_core.signals import ending, repeats
from quad_node.middleware import close_unless_asked

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


def init(args: list[str]) -> str:
    """Initialise rclpy without its own signal handlers, so that a node can still publish after SIGINT.

    Closed unless the user has chosen otherwise. Returns a line that says who can see the nodes.
    """
    seen_by = close_unless_asked()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    return seen_by


def on_signals(stop: "list[str]", done: Future, goes_on: Callable[[str], bool] | None = None) -> None:
    """Let SIGINT, SIGTERM and SIGHUP complete ``done``, one that is in ``stop`` already too; names go to ``stop``.

    The first signal does not if ``goes_on``, called with its name, returns true; nor do those that only repeat it.
    """
    goes_on_since: float | None = None

    def handler(number: int, _frame: FrameType | None) -> None:
        nonlocal goes_on_since
        if goes_on_since is not None and repeats(number, goes_on_since):
            return
        stop.append(signal.Signals(number).name)
        if goes_on is not None and len(stop) == 1 and goes_on(stop[0]):
            goes_on_since = time.monotonic()
            return
        if not done.done():
            done.set_result(None)

    for number in ending():
        signal.signal(number, handler)
    if stop and not done.done():
        done.set_result(None)
