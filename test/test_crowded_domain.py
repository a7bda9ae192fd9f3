"""Many come into one domain and leave it at once, and all who are there can be reached."""

import subprocess
import sys
import time

import flying

from quad_bringup.domains import reserved_domain

CROWD, TIME = 8, 12.0
NEWCOMERS, ANNOUNCEMENT = 20, 0.5

GUEST = """
import os, random, re, sys, time
from contextlib import suppress
from pathlib import Path
import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions
from quad_node.newcomer import Member

def files():
    for link in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):
            yield os.readlink(link)

domain, seed, until = int(sys.argv[1]), int(sys.argv[2]), time.monotonic() + float(sys.argv[3])
random, stays, lost = random.Random(seed), 0, []
while time.monotonic() < until:
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = Member("guest", context=context, enable_rosout=False, start_parameter_services=False)
    time.sleep(random.choice([0.0, 0.005, 0.03]))
    gone = set(re.findall(r"fastrtps_port(\\d+) \\(deleted\\)", Path("/proc/self/maps").read_text()))
    own = set(re.findall(r"port(\\d+)_[es]l", " ".join(files())))
    lost += gone & own
    stays += 1
    node.destroy_node()
    context.try_shutdown()
    del node, context
    time.sleep(random.choice([0.0, 0.05]))
print(stays, *lost)
"""

HOST = """
import sys, time
from pathlib import Path
import rclpy
from quad_node.newcomer import Member

rclpy.init(domain_id=int(sys.argv[1]))
node = Member("host")
time.sleep(3.5)  # by then it has said often enough that it is there
Path(sys.argv[2]).touch()
time.sleep(120.0)
"""


def test_nobody_s_queue_goes_while_others_come_and_leave():
    """A queue that its reader has open and that has lost its name is reached by nobody who comes later."""
    with reserved_domain(None) as domain:
        words = [sys.executable, "-c", GUEST, str(domain)]
        guests = [
            subprocess.Popen([*words, str(seed), str(TIME)], env=flying.in_domain(domain), stdout=subprocess.PIPE)
            for seed in range(CROWD)
        ]
        try:
            said = [guest.communicate(timeout=60.0)[0].decode().splitlines()[-1].split() for guest in guests]
        finally:
            for guest in guests:
                guest.kill()
                guest.wait()
    assert all(guest.returncode == 0 for guest in guests)
    assert sum(int(stays) for stays, *_ in said) > 10 * CROWD
    assert [lost for _, *lost in said if lost] == []


def test_a_newcomer_soon_knows_who_is_there(tmp_path):
    """Whoever is there answers before the newcomer listens, and says nothing more until his next announcement."""
    with reserved_domain(None) as domain:
        words = [sys.executable, "-c", HOST, str(domain), str(tmp_path / "there")]
        host = subprocess.Popen(words, env=flying.in_domain(domain))
        try:
            flying.wait_until((tmp_path / "there").exists, 20.0, "the host is there")
            times = [time_to_meet(domain) for _ in range(NEWCOMERS)]
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
