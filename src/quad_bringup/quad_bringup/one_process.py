"""All nodes of a flight in one process and one executor: the same messages over the same topics."""

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.experimental import EventsExecutor
from rclpy.task import Future

from quad_core.cascade import POSITION, STAGES
from quad_core.parameters import ParameterError
from quad_node import executor, parameters
from quad_node.flight_node import FlightNode
from quad_node.responder import LawNode

NAME = "one_process"
FAILED = 1
_INTERRUPTED = 4.0  # s in which the nodes still end the flight among themselves
_LAST_WORDS, _FEW_WORDS = 5.0, 0.2  # s, of a flight that ended and of one that was interrupted


def makers() -> list[Callable[[], FlightNode]]:
    """Return the classes of the nodes, the simulator first."""
    from quad_dynamics.node import Simulator
    from quad_flight_log.recorder.node import Recorder
    from quad_position_ctrl.node import make as make_position_controller
    from quad_trajectory.node import Trajectory

    return [
        Simulator,
        Trajectory,
        make_position_controller,
        *(partial(LawNode, stage.role) for stage in STAGES if stage.role != POSITION),
        Recorder,
    ]


def run(args: list[str]) -> int:
    """Run all nodes until each is done; returns the worst of their exit codes, 2 for a bad set-up."""
    try:
        parameters.check_arguments(args)
        seen_by = executor.init(args)
    except ParameterError as error:
        return parameters.fail(NAME, str(error))
    except Exception as error:  # rclpy raises its own RCLError and UnknownROSArgsError here: bad arguments
        return parameters.fail(NAME, " ".join(str(error).split()))
    nodes: list[FlightNode] = []
    stop: list[str] = []
    # nodes that are half made could not close what they have opened
    executor.on_signals(stop, Future())
    code = parameters.BAD_SETUP
    try:
        for make in makers():
            nodes.append(make())
            nodes[-1].introduce(seen_by)
        code = FAILED
        code = _spin(nodes, stop)
    except (ValueError, OSError, InvalidParameterTypeException, InvalidParameterValueException) as error:
        if code == FAILED:
            raise
        return parameters.fail(NAME, parameters.placed(str(error), args))
    finally:
        destroy(nodes, code)
        rclpy.try_shutdown()
    return code


def destroy(nodes: list[FlightNode], code: int) -> None:
    """Destroy the nodes; if one hangs, the process ends with ``code``."""
    while nodes:
        executor.destroy(nodes.pop().ros, code)


def _spin(nodes: list[FlightNode], stop: list[str]) -> int:
    """Spin until every node is done; a node that is done is spun no longer, as if its process had left.

    It is destroyed with the others when nothing spins any more: the executor may still hold an event of it.
    ``stop`` gets the names of signals; one that is in it already ends the flight at once.
    """
    halted = Future()
    executor.on_signals(stop, halted, nodes[0].on_signal)
    nodes[0].scheduled(executor.settle(nodes[0].priority))
    spinner = EventsExecutor()
    for node in nodes:
        spinner.add_node(node.ros)
    flying = list(nodes)
    worst, deadline = 0, float("inf")
    while flying and time.monotonic() < deadline:
        news = _any_of([node.done for node in flying] + ([halted] if deadline == float("inf") else []))
        if not news.done():
            patience = min(executor.SPIN_TIMEOUT, deadline - time.monotonic())
            spinner.spin_until_future_complete(news, timeout_sec=patience)
        if halted.done() and deadline == float("inf"):
            deadline = time.monotonic() + _INTERRUPTED
            nodes[0].on_interrupt(stop[0])
        for node in [node for node in flying if node.done.done()]:
            spinner.remove_node(node.ros)
            worst = max(worst, _closed(node, _FEW_WORDS if stop else _LAST_WORDS))
            flying.remove(node)
    for node in flying:
        spinner.remove_node(node.ros)
        worst = max(worst, FAILED, _closed(node, _FEW_WORDS))
    return worst


def _closed(node: FlightNode, patience: float) -> int:
    node.drain(patience)
    node.close()
    return node.exit_code


def _any_of(futures: list[Any]) -> Future:
    news = Future()

    def tell(_future: Any) -> None:
        if not news.done():
            news.set_result(None)

    for future in futures:
        if future.done():
            tell(future)
        future.add_done_callback(tell)
    return news


def main() -> None:
    """Run the nodes in this process."""
    if {"--help", "-h"} & set(sys.argv):
        sys.stdout.write(f"{__doc__}\n\nusage: ros2 run quad_bringup {NAME} --ros-args --params-file FILE\n")
        sys.exit(0)
    sys.exit(run(sys.argv))


if __name__ == "__main__":
    main()
