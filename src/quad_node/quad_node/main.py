"""From the command line to running nodes, and to an exit code that tells the truth."""

import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.experimental import EventsExecutor
from rclpy.task import Future

from quad_node import executor, parameters
from quad_node.flight_node import FlightNode

FAILED = 1  # exit code
# How long, in s, a node may take to see that its last messages arrived.
_INTERRUPTED, _ENDED = 0.5, 5.0
_AMONG_THEMSELVES = 4.0  # s in which several nodes end their flight after a signal


class Owner(Protocol):
    """A node of a flight: it has a ``FlightNode``."""

    node: FlightNode


def run(role: str, make: Callable[[], Owner], summary: str, args: list[str] | None = None) -> int:
    """Run one node until it is done; returns 0 flown to the end, 1 failed or interrupted, 2 bad set-up."""
    given = sys.argv if args is None else args
    if "--help" in given or "-h" in given:
        print(help_text(role, summary, given[0]))
        return 0
    return run_all(role, [make], given)


def run_all(name: str, makers: Sequence[Callable[[], Owner]], args: list[str]) -> int:
    """Run nodes in this process, under ``name``, until each is done; returns the worst of their exit codes as ``run``.

    A signal goes to the first one.
    """
    try:
        parameters.check_arguments(args)
        seen_by = executor.init(args)
    except Exception as error:  # besides ParameterError rclpy's own RCLError and UnknownROSArgsError: bad arguments
        return parameters.fail(name, " ".join(str(error).split()))
    nodes: list[FlightNode] = []
    stop: list[str] = []
    code = parameters.BAD_SETUP
    # nodes that are half made could not close what they have opened
    executor.on_signals(stop, Future())
    try:
        for make in makers:
            nodes.append(make().node)
            nodes[-1].introduce(seen_by)
        code = FAILED
        code = _spin(nodes, stop)
    except (ValueError, OSError, InvalidParameterTypeException, InvalidParameterValueException) as error:
        if code == FAILED:
            raise
        text = f"{error.filename or ''}: {error.strerror or error}" if isinstance(error, OSError) else str(error)
        return parameters.fail(name, parameters.placed(text, args, name if len(makers) == 1 else ""))
    finally:
        while nodes:
            executor.destroy(nodes.pop().ros, code)
        rclpy.try_shutdown()
    return code


def _spin(nodes: list[FlightNode], stop: list[str]) -> int:
    """Spin until every node is done; a node that is done is spun no longer, as if its process had left.

    It is destroyed with the others when nothing spins any more: the executor may still hold an event of it.
    A callback's exception propagates. The EventsExecutor takes half the CPU of the default one.
    ``stop`` gets the names of signals; one that is in it already ends the flight at once.
    """
    first, halted = nodes[0], Future()
    executor.on_signals(stop, halted, first.outlives)
    if refused := executor.settle(first.priority, first.in_background):
        first.events.warn("not_punctual", refused)
    spinner = EventsExecutor()
    for node in nodes:
        spinner.add_node(node.ros)
    flying, worst, deadline = list(nodes), 0, math.inf
    while flying:
        news = _any_of([node.done for node in flying] + ([halted] if deadline == math.inf else []))
        if not news.done():
            patience = max(0.0, min(executor.SPIN_TIMEOUT, deadline - time.monotonic()))
            spinner.spin_until_future_complete(news, timeout_sec=patience)
        if stop and deadline == math.inf and (halted.done() or first.done.done()):
            deadline = time.monotonic() + (_AMONG_THEMSELVES if len(nodes) > 1 else 0.0)
            first.interrupt(stop[0])
        ended = [node for node in flying if node.done.done() or time.monotonic() >= deadline]
        for node in ended:
            spinner.remove_node(node.ros)
            node.drain(_INTERRUPTED if stop else _ENDED)
            node.shut_down()
            worst = max(worst, node.exit_code)
            flying.remove(node)
    return worst


def _any_of(futures: list[Future]) -> Future:
    news = Future()
    for future in futures:
        future.add_done_callback(lambda _: news.done() or news.set_result(None))
    return news


def help_text(role: str, summary: str, program: str) -> str:
    """Return what --help prints; ``program``: the path of the executable, in the folder of its package."""
    start = f"ros2 run {Path(program).resolve().parent.name} {role}"
    return f"""{summary}

usage: {start} [--ros-args -p NAME:=VALUE --params-file FILE]

parameters: docs/reference/parameters/{role}.md; of a running node: ros2 param describe /{role} NAME

examples:
  {start} --ros-args -p flight.seed:=7
  {start} --ros-args --params-file flight.yaml -r __ns:=/second"""
