"""The live view: a node that shows a flight in Rerun while it is flown."""

import socket
import subprocess
from pathlib import Path

import rclpy

from quad_flight_log.live.node import Visitor
from quad_flight_log.live.scene import LiveScene
from quad_flight_log.live.shapes import Sight
from quad_flight_log.report.rerun_command import viewer_command
from quad_node import executor, shutdown


class LiveView(Visitor):
    """Feeds a viewer; completes ``done`` at the end of the flight if ``until_over``."""

    def __init__(self, scene: LiveScene, namespace: str, until_over: bool) -> None:
        """Subscribe in ``namespace``."""
        super().__init__("live_view", 0.02, namespace)
        self._scene, self._until_over = scene, until_over

    def on_sight(self, sight: Sight) -> None:
        """Show one instant."""
        self._scene.show(sight)

    def on_again(self) -> None:
        """Forget the paths of the flight before."""
        self._scene.again()

    def on_over(self) -> None:
        """Leave, if there is nothing more to wait for."""
        self._scene.flush()
        if self._until_over and not self.done.done():
            self.done.set_result(None)


def view(namespace: str = "", *, save: Path | None = None, web: bool = False) -> int:
    """Follow a flight of this ROS domain in a viewer, or record it to ``save`` until it is over; the exit code.

    Raises FlightLogError if rerun is not installed or ``save`` cannot be written.
    """
    scene = LiveScene()
    viewer: subprocess.Popen[bytes] | None = None
    if save:
        scene.save(save)
    else:
        port = _free_port()
        viewer = subprocess.Popen(viewer_command("--expect-data-soon", web=web, port=port))
        scene.connect(port)
    executor.init([])
    stop: list[str] = []
    node = LiveView(scene, namespace, until_over=save is not None)
    executor.on_signals(stop, node.done)
    try:
        if viewer:
            node.create_timer(0.5, lambda: _leave_with(viewer, node))
        executor.spin([node], node.done)
    finally:
        shutdown.destroy(node, 1)
        rclpy.try_shutdown()
        code = _closed(scene, viewer)
    return code


def _closed(scene: LiveScene, viewer: "subprocess.Popen[bytes] | None") -> int:
    """Hand over the last of the flight and end the viewer; returns its exit code if it had left by itself."""
    if viewer and viewer.poll() is not None:
        return int(bool(viewer.returncode))
    scene.flush()
    if viewer:
        viewer.terminate()
        viewer.wait()
    return 0


def _leave_with(viewer: "subprocess.Popen[bytes]", node: Visitor) -> None:
    if viewer.poll() is not None and not node.done.done():
        node.done.set_result(None)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
