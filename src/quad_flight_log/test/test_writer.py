"""A recorder on a bad day: full disk, no rights, a slow disk, unforeseen errors."""

import errno
import os
import subprocess
import sys
import textwrap
import threading
import time
import tracemalloc
from pathlib import Path

import flight_samples
import numpy as np
import pytest

from quad_flight_log import writer as bag_writer
from quad_flight_log.errors import FlightLogError
from quad_flight_log.reader import open_flight
from quad_flight_log.writer import BagWriter

FULL_DISK = """
    import resource, sys, time
    from pathlib import Path
    import flight_samples, numpy as np
    from quad_flight_log.writer import BagWriter

    unlimited = resource.RLIM_INFINITY
    about = {"seed": "7"}
    bag = BagWriter(Path(sys.argv[1]), metadata=about, flush_period=0.06)
    topic = bag.add_topic("/state", flight_samples.definition("quad_msgs/msg/VehicleState"))
    rng = np.random.default_rng(1)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, unlimited))
    step = 0
    while not bag.error and step < 100_000:
        bag.write(topic, flight_samples.encoded(flight_samples.state(step, rng)), step)
        step += 1
        if step % 100 == 0:
            time.sleep(0.01)
    if sys.argv[2] == "room again":
        resource.setrlimit(resource.RLIMIT_FSIZE, (unlimited, unlimited))
    taken = [bag.write(topic, bytes(124), step) for _ in range(3)]
    time.sleep(0.2)
    bag.close({"outcome": "ended"})
    print(any(taken), bag.dropped.total(), bag.path.name, bag.error)
"""


@pytest.fixture(scope="module", params=["full for good", "room again"])
def full(request, tmp_path_factory):
    """A bag whose disk took 100,000 bytes, then no more or more again; and what the writer said."""
    directory = tmp_path_factory.mktemp("full") / "bag"
    paths = [str(Path(__file__).parent), *sys.path]
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(FULL_DISK), str(directory), request.param],
        capture_output=True, text=True, timeout=120, check=False, env={"PYTHONPATH": ":".join(paths)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return directory, done.stdout.split(maxsplit=3)


def test_a_full_disk_ends_the_recording_with_its_cause_and_keeps_the_exact_beginning(full):
    directory, (taken, dropped, name, error) = full
    assert taken == "False"
    assert name == "bag_0.mcap.part"
    assert "File too large" in error
    flight = open_flight(directory)
    assert flight.truncated
    assert int(dropped) >= 3, "what was not taken is counted"
    assert not (directory / "metadata.yaml").exists()
    payloads, times = flight.payloads("/state")["/state"]
    assert payloads
    rng = np.random.default_rng(1)
    assert payloads == [flight_samples.encoded(flight_samples.state(step, rng)) for step in range(len(payloads))]
    assert times == list(range(len(times)))


def test_the_disk_is_told_to_keep_the_file_each_second_and_off_the_callback_path(tmp_path, monkeypatch):
    synced: list[tuple[float, str]] = []
    fsync = os.fsync

    def note(number):
        synced.append((time.monotonic(), threading.current_thread().name))
        fsync(number)

    monkeypatch.setattr(os, "fsync", note)
    monkeypatch.setattr("quad_flight_log.writer.SYNC_PERIOD", 0.1)
    bag = BagWriter(tmp_path / "bag")
    topic = bag.add_topic("/state", flight_samples.definition("quad_msgs/msg/VehicleState"))
    began = time.monotonic()
    while time.monotonic() - began < 0.6:
        bag.write(topic, bytes(124), 0)
        time.sleep(0.01)
    assert sum(name == "bag-sync" for _, name in synced) >= 3
    in_flight = [name for at, name in synced if at > began]
    assert set(in_flight) == {"bag-sync"}
    bag.close()
    assert bag.error == ""
    assert bag_writer.FLUSH_PERIOD + bag_writer.DRAIN_PERIOD < 0.3


def test_places_that_cannot_be_recorded_to_are_named(tmp_path):
    with pytest.raises(FlightLogError, match="cannot record here"):
        BagWriter("/proc/none/bag")
    (tmp_path / "file").touch()
    with pytest.raises(FlightLogError, match="file"):
        BagWriter(tmp_path / "file")
    with pytest.raises(FlightLogError, match="never overwritten"):
        BagWriter(tmp_path)


def test_a_backlog_beyond_its_limit_is_dropped_and_counted_per_topic(tmp_path, monkeypatch):
    monkeypatch.setattr(BagWriter, "_drain", lambda self: None)
    bag = BagWriter(tmp_path / "bag", backlog_limit=1000)
    handles = [
        bag.add_topic(name, flight_samples.definition("quad_msgs/msg/VehicleState")) for name in ("/state", "/truth")
    ]
    taken = [[bag.write(handle, bytes(124), 0) for handle in handles] for _ in range(10)]
    assert [sum(column) for column in zip(*taken, strict=True)] == [5, 4]
    assert bag.dropped == {"/state": 5, "/truth": 6}
    monkeypatch.undo()
    bag.close()
    assert (bag.messages, bag.error) == (9, "")
    facts = open_flight(bag.path).metadata
    assert (facts["dropped"], facts["dropped./state"], facts["dropped./truth"]) == ("11", "5", "6")


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), ValueError("surprise")])
def test_any_error_of_the_thread_ends_the_recording(error, tmp_path, monkeypatch):
    def fail(self):
        raise error

    bag = BagWriter(tmp_path / "bag")
    topic = bag.add_topic("/state", flight_samples.definition("quad_msgs/msg/VehicleState"))
    monkeypatch.setattr(BagWriter, "_drain", fail)
    bag.write(topic, bytes(124), 0)
    for thread in bag._threads[:1]:
        thread.join(timeout=5.0)
    assert not bag.write(topic, bytes(124), 1)
    assert bag.backlog == 0  # a plant that waits for the disk would wait for ever
    bag.close()
    assert (getattr(error, "strerror", None) or str(error)) in bag.error
    assert bag.dropped == {"/state": 1}
    assert open_flight(bag.path).truncated


def test_a_message_that_no_reader_would_unpack_is_refused_when_it_is_written(tmp_path):
    bag = BagWriter(tmp_path / "bag")
    topic = bag.add_topic("/flight/events", flight_samples.definition("quad_msgs/msg/FlightEvent"))
    assert bag.write(topic, flight_samples.encoded(flight_samples.event(0, "before")), 0)
    assert not bag.write(topic, flight_samples.encoded(flight_samples.event(1, "x" * 70_000_000)), 1)
    assert bag.write(topic, flight_samples.encoded(flight_samples.event(2, "after")), 2)
    bag.close()
    assert (bag.messages, bag.dropped.total(), bag.error) == (2, 1, "")
    flight = open_flight(bag.path)
    assert flight.array("flight/events")["text"].tolist() == ["before", "after"]
    assert flight.metadata["dropped./flight/events"] == "1"


def test_memory_grows_by_the_index_of_its_chunks_alone(tmp_path, monkeypatch):
    """The writer of mcap keeps the index of every chunk until the end; a chunk comes every 0.2 s."""
    monkeypatch.setattr(BagWriter, "_drain_loop", lambda self: None)
    bag = BagWriter(tmp_path / "bag")
    handles = [
        bag.add_topic(f"/t{number}", flight_samples.definition("quad_msgs/msg/VehicleState")) for number in range(20)
    ]

    def grown(chunks: int) -> int:
        tracemalloc.start()
        for _ in range(chunks):
            for handle in handles:
                bag.write(handle, bytes(124), 0)
            bag._drain()
            bag._writer.flush()
        found = tracemalloc.get_traced_memory()[0]
        tracemalloc.stop()
        return found

    grown(100)
    assert grown(400) < 400 * 2_000
    bag.close()
    assert bag.error == ""
