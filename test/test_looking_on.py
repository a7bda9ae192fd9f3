"""Shells that look on while a flight is in the air cost it nothing."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest
from flying import finish, start, wait_until_flying

from quad_flight_log.bag.reader import open_flight

pytestmark = [pytest.mark.flight, pytest.mark.wall_clock]

# As `ros2 topic echo` and RViz do, each subscribes when its node is more than a second old.
ONLOOKER = """
import sys, time
import rclpy
from geometry_msgs.msg import WrenchStamped
from quad_node import executor
executor.init([])
node = rclpy.create_node("onlooker")
time.sleep(float(sys.argv[1]))
node.create_subscription(WrenchStamped, "wrench_setpoint", lambda message: None, 1)
end = time.monotonic() + 0.3
while time.monotonic() < end:
    rclpy.spin_once(node, timeout_sec=0.1)
node.destroy_node()
rclpy.shutdown()
"""


def test_nodes_that_come_to_look_on_do_not_disturb_a_flight(tmp_path):
    out = tmp_path / "bag"
    flight = start("hover", "--realtime", "--duration", "30", "--out", out)
    domain = re.search(r"ROS_DOMAIN_ID=(\d+)", flight.stdout.readline())[1]
    wait_until_flying(flight, out)
    for late in np.linspace(1.2, 2.1, 10):
        words = [sys.executable, "-c", ONLOOKER, str(late)]
        subprocess.run(words, check=True, timeout=30, env={**os.environ, "ROS_DOMAIN_ID": domain})
    done = finish(flight)
    assert done.returncode == 0, done.stdout + done.stderr
    guard = open_flight(out).array("flight/guard")
    assert not guard["mode"].any()
