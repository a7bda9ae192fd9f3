"""All five nodes in one process and one executor: the same messages over the same topics, without processes between."""

import sys
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.task import Future

from quad_core.parameters import ParameterError
from quad_node import executor, parameters, scheduling
from quad_node.flight_node import FlightNode

NAME = "one_process"
_INTERRUPTED = 1.5  # s in which the nodes still end the flight among themselves
_LAST_WORDS, _FEW_WORDS = 5.0, 0.2  # s, of a flight that ended and of one that was interrupted


def makers() -> list[Callable[[], FlightNode]]:
    """Return the classes of the five nodes, the simulator first."""
    from quad_attitude_ctrl.node import AttitudeController
    from quad_dynamics.node import Simulator
    from quad_flight_log.node import Recorder
    from quad_position_ctrl.node import PositionController
    from quad_trajectory.node import Trajectory

    return [Simulator, Trajectory, PositionController, AttitudeController, Recorder]


def run(args: list[str]) -> int:
    """Run all nodes until each is done; returns the worst of their exit codes, 2 for a bad set-up."""
    try:
        parameters.check_files(args)
        executor.init(args)
    except ParameterError as error:
        return parameters.fail(NAME, str(error))
    nodes: list[FlightNode] = []
    try:
        for make in makers():
            nodes.append(make())  # noqa: PERF401 (what was made must be destroyed if the next cannot be)
    except (ValueError, OSError, InvalidParameterTypeException, InvalidParameterValueException) as error:
        destroy(nodes)
        rclpy.try_shutdown()
        return parameters.fail(NAME, str(error))
    try:
        return _spin(nodes)
    finally:
        destroy(nodes)
        rclpy.try_shutdown()


def destroy(nodes: list[FlightNode]) -> None:
    """Destroy what is left of the nodes."""
    while nodes:
        nodes.pop().destroy_node()


def _spin(nodes: list[FlightNode]) -> int:
    """Spin until every node is done; a done node leaves at once, as its process would."""
    halted = Future()
    stop: list[str] = []
    executor.on_signals(stop, halted)
    nodes[0].scheduled(scheduling.settle(nodes[0].priority))
    spinner = executor.make_executor()
    for node in nodes:
        spinner.add_node(node)
    worst, deadline = 0, float("inf")
    while nodes and time.monotonic() < deadline:
        news = _any_of([node.done for node in nodes] + ([] if stop else [halted]))
        spinner.spin_until_future_complete(news, timeout_sec=min(executor.SPIN_TIMEOUT, deadline - time.monotonic()))
        if stop and deadline == float("inf"):
            deadline = time.monotonic() + _INTERRUPTED
            nodes[0].on_interrupt(stop[0])
        for node in [node for node in nodes if node.done.done()]:
            spinner.remove_node(node)
            worst = max(worst, _left(node, _FEW_WORDS if stop else _LAST_WORDS))
            nodes.remove(node)
    for node in nodes:
        worst = max(worst, 1, _left(node, _FEW_WORDS))
    return worst


def _left(node: FlightNode, patience: float) -> int:
    node.drain(patience)
    node.close()
    code = node.exit_code
    node.destroy_node()
    return code


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
    """Run the five nodes in this process."""
    if {"--help", "-h"} & set(sys.argv):
        sys.stdout.write(f"{__doc__}\n\nusage: ros2 run quad_bringup {NAME} --ros-args --params-file FILE\n")
        sys.exit(0)
    sys.exit(run(sys.argv))


if __name__ == "__main__":
    main()
