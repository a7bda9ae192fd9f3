"""When the recorder leaves, without a flight."""

import time

from quad_flight_log.node import Recorder


def test_a_recorder_that_is_asked_to_end_waits_for_no_vehicle_that_is_gone(start_node, tmp_path):
    node = start_node(Recorder, f"directory:={tmp_path / 'bag'}", "flight.mode:=realtime")
    node.node.flying, node._arrived = True, time.monotonic()
    assert node.node.outlives("SIGTERM")
    node._watch()
    assert not node.node.done.done()
    node._arrived -= 5.0
    node._watch()
    assert (node.node.done.done(), node.node.exit_code) == (True, 1)
    node.shut_down()
