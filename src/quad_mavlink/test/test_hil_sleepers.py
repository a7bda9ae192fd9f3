"""Who sleeps, as /proc says it, of processes that a test starts: each sleeps on what it waits for, or works."""

import socket
import subprocess
import sys
import time
from contextlib import closing

import pytest

from quad_mavlink.hil import sleepers

WORKER = """
import sys, time
for seconds in sys.stdin:
    until = time.monotonic() + float(seconds)
    while time.monotonic() < until:
        pass
    print("done", flush=True)
"""
AUTOPILOT = """
import socket, sys
link = socket.create_connection(("127.0.0.1", int(sys.argv[1])))
client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
client.connect(("127.0.0.1", int(sys.argv[2])))
print("up", flush=True)
sys.stdin.read()
"""
AGENT = """
import socket, sys
server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
server.bind(("0.0.0.0", 0))
print(server.getsockname()[1], flush=True)
sys.stdin.read()
"""
TABLE = """  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode
   0: 0100007F:11D0 0100007F:A3F2 01 00000000:00000000 00:00000000 00000000  1000        0 4711 1 0 20 4 30 10 -1
"""


@pytest.fixture
def start():
    """Return what starts a Python program; all end with the test."""
    started = []

    def start(text, *words):
        command = [sys.executable, "-c", text, *map(str, words)]
        started.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


def is_quiet_within(watch, patience):
    until = time.monotonic() + patience
    while time.monotonic() < until:
        if watch.is_quiet():
            return True
    return False


def test_who_works_is_seen_and_who_waits_sleeps(start):
    worker = start(WORKER)
    with closing(sleepers.Watch([worker.pid])) as watch:
        assert is_quiet_within(watch, 30.0)
        worker.stdin.write("1.0\n")
        worker.stdin.flush()
        until = time.monotonic() + 0.5
        while time.monotonic() < until:
            assert not watch.is_quiet()  # from the moment it was woken, whether it has a processor or not
        assert worker.stdout.readline() == "done\n"
        assert is_quiet_within(watch, 30.0)


def test_a_thread_that_rested_for_long_is_seen_again(start):
    worker = start(WORKER)
    with closing(sleepers.Watch([worker.pid])) as watch:
        for _ in range(500):
            assert is_quiet_within(watch, 30.0)
        worker.stdin.write("600\n")
        worker.stdin.flush()
        until, is_seen = time.monotonic() + 30.0, False
        while not is_seen and time.monotonic() < until:
            is_seen = not watch.is_quiet()
        assert is_seen


def test_a_process_that_has_ended_does_not_hold_up_anybody(start):
    worker = start(WORKER)
    with closing(sleepers.Watch([worker.pid])) as watch:
        assert is_quiet_within(watch, 30.0)
        worker.kill()
        worker.wait()
        assert is_quiet_within(watch, 30.0)


def test_the_autopilot_is_found_by_its_connection_and_its_agent_by_where_it_sends(start):
    agent = start(AGENT)
    port = agent.stdout.readline().strip()
    with closing(socket.create_server(("127.0.0.1", 0))) as server:
        autopilot = start(AUTOPILOT, server.getsockname()[1], port)
        peer, _ = server.accept()
        autopilot.stdout.readline()
        with closing(peer):
            assert sleepers.parties(peer) == sorted([autopilot.pid, agent.pid])
    assert sleepers.name(autopilot.pid).startswith("python")
    assert sleepers.parties(peer) == []  # closed


def test_a_table_of_sockets_is_read():
    assert list(sleepers.rows(TABLE)) == [sleepers.Row(("0100007F", "11D0"), ("0100007F", "A3F2"), 4711)]
