"""Many come into one domain and leave it at once, and all who are there can be reached."""

import subprocess
import sys

import flying

from quad_bringup.domains import reserved_domain

CROWD, TIME = 8, 12.0

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
