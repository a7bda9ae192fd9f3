"""A recorder that is killed or whose disk is full: what it had stays, and the flight reports it."""

import os
import random
import resource
import signal
import subprocess
import sys
import time

import flying
import pytest

from quad_flight_log.reader import open_flight

LIMIT = 0.3  # s of wall clock
STREAM = """
import struct, sys, time
from quad_flight_log.writer import BagWriter
from quad_flight_log.payload_check import definition_of
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


@pytest.mark.parametrize("number", range(3))
def test_what_is_older_than_300_ms_survives_kill_9(number, tmp_path):
    words = [sys.executable, "-c", STREAM, str(tmp_path / "bag")]
    writer = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert writer.stdout.readline() == "ready\n"
    time.sleep(random.Random(number).uniform(0.3, 1.2))
    killed = time.time_ns()
    writer.kill()
    writer.communicate()
    flown = open_flight(tmp_path / "bag")
    last = 0
    for payloads, times in flown.payloads(*flown.topics).values():
        indices = [int.from_bytes(payload[4:12], "little") for payload in payloads]
        assert indices == list(range(len(indices)))
        last = max([last, *times])
    assert (killed - last) * 1e-9 < LIMIT
    assert flown.truncated
    assert flown.metadata["seed"] == "7"
    assert not list((tmp_path / "bag").glob("*.mcap"))


@pytest.mark.flight
def test_a_flight_goes_on_when_the_disk_is_full(tmp_path):
    directory = tmp_path / "bag"
    process = flying.start("hover", "--duration", "1", "--out", directory)
    pids = flying.wait_until_flying(process, directory, 60_000)
    limit = flying.bag_file(directory).stat().st_size + 100_000
    resource.prlimit(pids["recorder"], resource.RLIMIT_FSIZE, (limit, limit))
    done = flying.finish(process)
    assert done.returncode == 1
    flight = open_flight(directory)
    assert flight.truncated
    recorded = flight.topics["/truth"].messages
    assert recorded > 0
    simulator, recorder = ((directory / "logs" / f"{role}.log").read_text() for role in ("simulator", "recorder"))
    assert recorder.count("recording_stopped: ") == 1
    assert "File too large" in recorder
    assert "flight_failed" not in simulator
    assert "recorder ended with exit code 1" in done.stderr or "the bag is cut" in done.stderr


@pytest.mark.flight
def test_a_flight_of_a_commander_goes_on_without_its_recorder_and_the_verdict_says_where_the_bag_ends(tmp_path):
    """In lockstep; scripts/accept stops does the same in real time."""
    out = tmp_path / "bag"
    process = flying.start("--mission", "takeoff:1,hold:1,land", "--out", out)
    pids = flying.wait_until_flying(process, out, 1_000_000)  # the vehicle is in the air
    os.kill(pids["recorder"], signal.SIGKILL)
    done = flying.finish(process)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "recorder was killed by SIGKILL: the flight goes on, and what is flown from now on is" in done.stderr
    assert "the bag ends at " in done.stderr
    assert "the flight itself went on to " in done.stderr
    assert "s: ended" in done.stderr
    assert "motors stopped" not in done.stderr
    assert "hung" not in done.stderr
    log = (out / "logs" / "commander.log").read_text()
    assert "HOLD to LAND: asked for by mission" in log
    assert "HOLD to LAND: asked for by mission" in done.stderr, "the terminal shows changes of mode"
    assert "LAND to DISARMED" in log
