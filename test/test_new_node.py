"""A node that joins a domain soon knows the nodes in it."""

import subprocess
import sys
import time

import flying
import pytest

from quad_bringup.surroundings import reserved_domain

pytestmark = pytest.mark.wall_clock

NEW_NODES, ANNOUNCEMENT = 8, 0.5

HOST = """
import sys, time
from pathlib import Path
import rclpy
from rclpy.node import Node

rclpy.init(domain_id=int(sys.argv[1]))
node = Node("host")
time.sleep(3.5)  # by then it has said often enough that it is there
Path(sys.argv[2]).touch()
time.sleep(120.0)
"""


def test_a_new_node_soon_knows_the_others(tmp_path):
    """The others answer its first announcement before it receives, and say no more until their next announcement."""
    with reserved_domain(None) as domain:
        words = [sys.executable, "-c", HOST, str(domain), str(tmp_path / "there")]
        host = subprocess.Popen(words, env=flying.in_domain(domain))
        try:
            flying.wait_until((tmp_path / "there").exists, 20.0, "the host is there")
            times = [time_to_meet(domain) for _ in range(NEW_NODES)]
        finally:
            host.kill()
            host.wait()
    assert max(times) < ANNOUNCEMENT + 0.5, times


def time_to_meet(domain):
    """Return how many s after it has joined a node knows the host."""
    with flying.stranger(domain) as node:
        joined = time.monotonic()
        while "host" not in node.get_node_names():
            assert time.monotonic() - joined < 10.0
            time.sleep(0.01)
        return time.monotonic() - joined
