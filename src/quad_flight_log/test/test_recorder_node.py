"""When the recorder leaves, without a flight."""

import time

import rclpy

from quad_flight_log.recorder.node import Recorder
from quad_node import executor


def test_a_recorder_that_is_asked_to_end_waits_for_no_vehicle_that_is_gone(own_domain, tmp_path):
    executor.init(["--ros-args", "-p", f"directory:={tmp_path / 'bag'}", "-p", "flight.mode:=realtime"])
    node = Recorder()
    try:
        node.flying, node._arrived = True, time.monotonic()
        assert node.on_signal("SIGTERM")
        node.on_tick()
        assert not node.done.done()
        node._arrived -= 5.0
        node.on_tick()
        assert (node.done.done(), node.exit_code) == (True, 1)
    finally:
        node.close()
        node.ros.destroy_node()
        rclpy.try_shutdown()
