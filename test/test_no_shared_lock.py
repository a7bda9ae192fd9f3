"""No node shares memory or a lock with another process: a process that is killed with a lock would stop the others."""

import os
import re
import socket
from pathlib import Path

import pytest
from flying import domain_of, finish, run_id_of, start, wait_until, wait_until_flying
from sockets import GROUP, LOOPBACK, udp_addresses

from quad_flight_log.reader import open_flight
from quad_node.watch import FlightWatch

pytestmark = pytest.mark.flight

SHADOWS = ("--shadow", "position=aibs", "--shadow", "attitude=abfnitsm")
QUEUE = re.compile(r"/dev/shm/\S*fastrtps")


@pytest.mark.parametrize("clock", [
    pytest.param(("--realtime", "--duration", "5", *SHADOWS), id="real", marks=pytest.mark.wall_clock),
    pytest.param(("--duration", "4"), id="lockstep"),
])  # fmt: skip
def test_no_node_has_shared_memory_and_datagrams_on_every_port_change_nothing(tmp_path, clock):
    out = tmp_path / "bag"
    process = start("hover", *clock, "--limits", "position_max=0.1", "--out", out)
    pids = wait_until_flying(process, out)
    for name, pid in pids.items():
        assert not QUEUE.search(Path(f"/proc/{pid}/maps").read_text()), name
        assert {where for where, _ in udp_addresses(pid)} == {LOOPBACK, GROUP}, name
    ports = sorted({port for pid in pids.values() for where, port in udp_addresses(pid) if where == LOOPBACK})
    assert len(ports) >= 2 * len(pids)
    watch = FlightWatch(run_id_of(process.pid), domain_of(process.pid))
    begun = wait_for_step(watch, 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(200):
            for port in ports:
                # every second one begins as a message of RTPS does
                noise = os.urandom(120)
                sender.sendto(noise, (LOOPBACK, port))
                sender.sendto(b"RTPS\x02\x03" + noise, (LOOPBACK, port))
    wait_for_step(watch, begun + 500)
    watch.close()
    done = finish(process)
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(open_flight(out).metadata.get("dropped", "-1")) == 0


def wait_for_step(watch, step):
    """Return the first step after ``step`` that the flight says it has flown."""
    found = []
    wait_until(
        lambda: (state := watch.poll(0.1)) and state.step > step and not found.append(state.step),
        20.0,
        f"a step after {step}",
    )
    return found[0]
