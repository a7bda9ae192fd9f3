"""A domain in which a node was killed: who comes next finds it clean, and its queues are left alone while one lives."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import flying
import pytest

from quad_bringup.domains import reserved_domain
from quad_bringup.surroundings import publishers
from quad_node.newcomer import apart_from_the_dead

pytestmark = pytest.mark.flight

NODE = "import rclpy, sys; rclpy.init(); node = rclpy.create_node('a'); print('up', flush=True); sys.stdin.read()"


@pytest.fixture
def domain():
    with reserved_domain(None) as reserved:
        yield reserved


def queues(domain):
    """Return the names of the queues of Fast DDS in shared memory of a domain."""
    first = 7400 + 250 * domain
    return {
        f"fastrtps_port{port}" for port in range(first, first + 250) if Path(f"/dev/shm/fastrtps_port{port}").exists()
    }


def killed_in(domain):
    """Kill two nodes in a domain; what they leave is older than who is just starting would be."""
    words, environment = [sys.executable, "-c", NODE], {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    both = [subprocess.Popen(words, env=environment, **pipes) for _ in range(2)]
    for process in both:
        assert process.stdout.readline() == b"up\n"
    for process in both:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    time.sleep(1.1)
    return queues(domain)


def test_who_looks_into_a_dead_domain_leaves_it_clean(domain):
    assert killed_in(domain)
    assert publishers(domain, "", patience=0.1) == {}
    assert queues(domain) == set()


def test_where_somebody_lives_no_queue_goes(domain):
    with flying.stranger(domain, "living"):
        living = queues(domain)
        left = killed_in(domain)
        assert left > living
        with apart_from_the_dead(domain):
            assert queues(domain) == left
