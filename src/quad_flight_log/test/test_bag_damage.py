"""A damaged or foreign bag gives a verified prefix or a typed error, never wrong numbers, never a lot of memory."""

import struct
from collections import Counter
from pathlib import Path

import flight_samples
import numpy as np
import pytest
from mcap.writer import CompressionType
from other_recorders import Sent, in_one_file, sent

from quad_flight_log.errors import CorruptError, FlightLogError, SchemaError
from quad_flight_log.reader import Flight, open_flight

FLIPS = 600
Content = tuple[dict[str, list[bytes]], dict[str, list[int]], dict[str, str]]


def content(flight: Flight) -> Content:
    """Return all that a flight holds: payloads, times and metadata."""
    found = flight.payloads(*flight.topics)
    return (
        {name: payloads for name, (payloads, _) in found.items()},
        {name: times for name, (_, times) in found.items()},
        flight.metadata,
    )


def is_prefix(part: Content, whole: Content) -> bool:
    """Return whether ``part`` is the beginning of ``whole`` and holds nothing else."""
    payloads, times, metadata = part
    return (
        all(rows == whole[0][name][: len(rows)] for name, rows in payloads.items())
        and all(rows == whole[1][name][: len(rows)] for name, rows in times.items())
        and metadata.items() <= whole[2].items()
    )


def outcome(path: Path, whole: Content) -> str:
    """Read and verify the bag at ``path``: ``same``, ``prefix``, ``error``, or ``WRONG`` if it is silently other."""
    try:
        flight = open_flight(path)
        found = content(flight)
    except FlightLogError:
        return "error"
    if found == whole:
        return "prefix" if flight.truncated else "same"
    return "prefix" if flight.truncated and is_prefix(found, whole) else "WRONG"


def small_bag(directory: Path, *, close: bool) -> Path:
    """Write a bag of two topics and at least two chunks; returns the MCAP file."""
    flown = [item for item in flight_samples.samples(8) if item[0] in ("/wrench_setpoint", "/flight/events")]
    return flight_samples.write_bag(directory, flown, pause_every=4, close=close)


@pytest.fixture(scope="module", params=["closed", "unclosed"])
def bag(request, tmp_path_factory) -> Path:
    return small_bag(tmp_path_factory.mktemp(request.param) / "bag", close=request.param == "closed")


@pytest.fixture(scope="module")
def unclosed(tmp_path_factory) -> Path:
    return small_bag(tmp_path_factory.mktemp("cut") / "bag", close=False)


def test_killed_recorder_leaves_a_readable_part(unclosed):
    flight = open_flight(unclosed.parent)
    assert flight.truncated
    assert flight.metadata["seed"] == "7"
    assert flight.topics["/wrench_setpoint"].messages == 8


def test_truncation_at_every_byte_gives_prefix_or_error(bag, tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(bag.read_bytes())
    whole, found = content(open_flight(bag)), Counter()
    with path.open("r+b") as stream:
        for length in range(path.stat().st_size - 1, -1, -1):
            stream.truncate(length)
            found[outcome(path, whole)] += 1
    assert set(found) <= {"prefix", "error"}
    assert found.total() == bag.stat().st_size
    assert found["prefix"] > found.total() / 2


def test_bit_flips_are_never_silently_wrong(bag, tmp_path):
    path = tmp_path / "flip.mcap"
    data, whole, rng = bag.read_bytes(), content(open_flight(bag)), np.random.default_rng(5)
    for at, bit in zip(rng.integers(len(data), size=FLIPS).tolist(), rng.integers(8, size=FLIPS).tolist(), strict=True):
        path.write_bytes(data[:at] + bytes([data[at] ^ (1 << bit)]) + data[at + 1 :])
        assert outcome(path, whole) != "WRONG", f"bit {bit} of byte {at}"


def test_a_damaged_note_of_the_recorder_is_an_error_that_names_it(unclosed, tmp_path):
    path = tmp_path / "note.mcap"
    data = unclosed.read_bytes()
    at = data.index(b"seed") + len(b"seed") + 4
    path.write_bytes(data[:at] + b"8" + data[at + 1 :])
    with pytest.raises(CorruptError, match="'quad': its digest does not fit"):
        open_flight(path)


def test_a_tail_of_zeros_leaves_a_prefix_and_one_of_garbage_is_an_error(unclosed, tmp_path):
    path, whole = tmp_path / "tail.mcap", content(open_flight(unclosed))
    path.write_bytes(unclosed.read_bytes() + bytes(5000))
    assert outcome(path, whole) == "prefix"
    path.write_bytes(unclosed.read_bytes() + b"\x00\x01garbage")
    with pytest.raises(CorruptError, match="RecordLengthLimitExceeded"):
        open_flight(path)


@pytest.mark.parametrize("data", [b"", b"hello, world\n", b"\x00" * 100])
def test_foreign_files_are_named(data, tmp_path):
    path = tmp_path / "foreign.mcap"
    path.write_bytes(data)
    with pytest.raises(FlightLogError, match=r"foreign\.mcap"):
        open_flight(path)


def test_places_without_a_bag_are_named(tmp_path):
    with pytest.raises(FlightLogError, match="no such file"):
        open_flight(tmp_path / "nowhere")
    with pytest.raises(FlightLogError, match=r"no \*\.mcap"):
        open_flight(tmp_path)


def states(count=5, text: bytes = b"", bad: bytes | None = None) -> list[Sent]:
    """Return states as another tool receives them; ``text``: of another definition, ``bad``: what the second holds."""
    rng = np.random.default_rng(2)
    found = [sent("state", flight_samples.state(step, rng)) for step in range(count)]
    found = [one._replace(text=text or one.text) for one in found]
    return found if bad is None else [found[0], found[1]._replace(data=bad), *found[2:]]


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE, "enable_crcs": False},
        {"use_chunking": False},
        {"use_statistics": False, "use_summary_offsets": False},
    ],
)
def test_bags_of_other_writers_are_read(options, tmp_path):
    flight = open_flight(in_one_file(tmp_path / "other.mcap", states(), **options))
    assert flight.payloads("state")["/state"][0] == [one.data for one in states()]


WRONG = [
    b"float64 x\n",
    b"float64[3] x\nMissing y\n",
    b"%&/\n",
    b"\xff\xfe",
    b"string a\n",
    b"quad_msgs/VehicleState me\n",
]


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_definition_is_an_error(text, tmp_path):
    with pytest.raises(SchemaError):
        open_flight(in_one_file(tmp_path / "wrong.mcap", states(text=text))).array("state")


GOOD = states()[1].data


@pytest.mark.parametrize("bad", [GOOD[:50], b"", b"\x00", b"\x00\x03\x00\x00" + GOOD[4:], GOOD + bytes(8)])
def test_a_short_or_strange_payload_is_an_error(bad, tmp_path):
    with pytest.raises(SchemaError, match="/state"):
        open_flight(in_one_file(tmp_path / "bad.mcap", states(bad=bad))).array("state")


def test_a_sequence_longer_than_its_message_is_refused(tmp_path):
    event = sent("event", flight_samples.event(1, "text"))
    lying = event._replace(data=event.data[:12] + struct.pack("<I", 0xFFFFFFF0) + event.data[16:])
    with pytest.raises(SchemaError):
        open_flight(in_one_file(tmp_path / "lying.mcap", [lying])).array("event")
