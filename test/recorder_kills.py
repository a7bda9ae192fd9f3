"""Recorders killed with -9: how much of what they had received is missing from the file."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import flying
import numpy as np
from mcap.records import Message
from mcap.stream_reader import StreamReader

from quad_flight_log.bag.reader import Flight, open_flight

LIMIT = 0.3  # s of wall clock
_STREAM = """
import struct, sys, time
from quad_flight_log.bag.writer import BagWriter
from quad_flight_log.recorder.message_fields import definition_of
from quad_msgs.msg import VehicleState

bag = BagWriter(sys.argv[1], metadata={"seed": "7"})
topics = [bag.add_topic(f"/t{i}", definition_of(VehicleState)) for i in range(5)]
print("ready", flush=True)
index = 0
while True:
    for topic in topics:
        now = time.time_ns()
        bag.write(topic, struct.pack("<IQ", 0x00000100, index) + bytes(112), now, now)
    index += 1
    time.sleep(0.001)
"""


class Loss(NamedTuple):
    """What a kill cost: wall clock in s between the last message in the file and the kill, and flight time in s."""

    wall: float
    flight: float
    messages: int
    flown: Flight


def killed_writer(directory: Path, after: float) -> Loss:
    """Kill a process that writes 5 topics at up to 1 kHz ``after`` s; the loss counts every message of the prefix."""
    writer = subprocess.Popen([sys.executable, "-c", _STREAM, str(directory)], stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None
    assert writer.stdout.readline() == "ready\n"
    time.sleep(after)
    at = time.time_ns()
    writer.kill()
    writer.communicate()
    flight = open_flight(directory)
    last = 0
    for payloads, times in flight.payloads(*flight.topics).values():
        indices = [int.from_bytes(payload[4:12], "little") for payload in payloads]
        assert indices == list(range(len(indices)))
        last = max([last, *times])
    return Loss((at - last) * 1e-9, 0.0, sum(topic.messages for topic in flight.topics.values()), flight)


def written(path: Path) -> list[tuple[int, int]]:
    """Return (publish time, log time) in ns of every message of a cut file."""
    found = []
    with path.open("rb") as stream, suppress(Exception):  # whatever mcap raises where the file ends
        for record in StreamReader(stream).records:
            if isinstance(record, Message):
                found.append((record.publish_time, record.log_time))  # noqa: PERF401 (it ends with an error)
    return found


def killed_recorder(directory: Path, after: float) -> tuple[Loss, subprocess.CompletedProcess[str]]:
    """Kill the recorder of a flight over ROS ``after`` s from its first steps; returns the loss and how `fly` ended."""
    process = flying.start("case1", "--out", directory)
    part = directory / f"{directory.name}_0.mcap.part"
    flying.wait_until(lambda: part.exists() and part.stat().st_size > 100_000, 90.0, "the recording began")
    time.sleep(after)
    victim = pid_of(process.pid, "recorder")
    at = time.time_ns()
    os.kill(victim, signal.SIGKILL)
    done = flying.finish(process)
    flight = open_flight(directory)
    times = np.array(written(flight.path), dtype=np.int64)
    wall = float(at - times[:, 0].max()) * 1e-9
    recent = times[times[:, 0] > times[:, 0].max() - 1_000_000_000]
    pace = float(np.ptp(recent[:, 1])) / max(float(np.ptp(recent[:, 0])), 1.0)
    return Loss(wall, wall * pace, len(times), flight), done


def pid_of(parent: int, executable: str, name: str = "") -> int:
    """Return the pid of the node with that executable (and ``name``, where it is remapped) among those of ``fly``."""
    for pid in flying.children(parent):
        command = Path(f"/proc/{pid}/cmdline").read_bytes()
        if f"/{executable}\0".encode() in command and f"__node:={name}".encode() * bool(name) in command:
            return pid
    raise AssertionError(f"no {name or executable} among the children of {parent}")
