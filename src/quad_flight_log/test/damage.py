"""Damaged copies of a bag: read, they give a verified prefix or a typed error, never anything else."""

from collections.abc import Iterator
from pathlib import Path

import flight_samples
import numpy as np

from quad_flight_log.bag.reader import Flight, open_flight
from quad_flight_log.errors import FlightLogError

Content = tuple[dict[str, list[bytes]], dict[str, list[int]], dict[str, str], str]


def small_bag(directory: Path, *, close: bool) -> Path:
    """Write a bag of two topics and at least two chunks; returns the MCAP file."""
    flown = [item for item in flight_samples.samples(8) if item[0] in ("/wrench_setpoint", "/flight/events")]
    return flight_samples.write_bag(directory, flown, pause_every=4, close=close)


def content(flight: Flight) -> Content:
    """Return all that a flight holds: payloads, times, metadata and the text of its parameters."""
    found = flight.payloads(*flight.topics)
    return (
        {name: payloads for name, (payloads, _) in found.items()},
        {name: times for name, (_, times) in found.items()},
        flight.metadata,
        flight.parameters_text,
    )


def is_prefix(part: Content, whole: Content) -> bool:
    """Return whether ``part`` is the beginning of ``whole`` and holds nothing else."""
    payloads, times, metadata, text = part
    return (
        all(rows == whole[0][name][: len(rows)] for name, rows in payloads.items())
        and all(rows == whole[1][name][: len(rows)] for name, rows in times.items())
        and metadata.items() <= whole[2].items()
        and text in ("", whole[3])
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


def truncations(path: Path, whole: Content) -> Iterator[str]:
    """Shorten the file at ``path`` byte by byte and yield each outcome."""
    with path.open("r+b") as stream:
        for length in range(path.stat().st_size - 1, -1, -1):
            stream.truncate(length)
            yield outcome(path, whole)


def flips(path: Path, whole: Content, count: int, seed: int) -> Iterator[tuple[str, int, int]]:
    """Flip one random bit of the file at ``path`` at a time; yield (outcome, byte, bit)."""
    rng = np.random.default_rng(seed)
    data = path.read_bytes()
    with path.open("r+b", buffering=0) as stream:
        for at, bit in zip(
            rng.integers(len(data), size=count).tolist(), rng.integers(8, size=count).tolist(), strict=True
        ):
            stream.seek(at)
            stream.write(bytes([data[at] ^ (1 << bit)]))
            yield outcome(path, whole), at, bit
            stream.seek(at)
            stream.write(data[at : at + 1])
