"""One flight through readers of others: each gives {topic: (count, digest over all values)}."""

import hashlib
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import flight_samples
import numpy as np

from quad_flight_log.reader import open_flight

Digests = dict[str, tuple[int, str]]


def leaves(value: Any) -> Iterator[bytes]:
    """Yield every number (as float64) and text of a message in the order of its definition, lists by their length."""
    if isinstance(value, str):
        yield struct.pack("<d", len(value.encode())) + value.encode()
    elif isinstance(value, np.void):
        for name in value.dtype.names:
            yield from leaves(value[name])
    elif hasattr(value, "__msgtype__"):
        for name, _ in flight_samples.typestore().fielddefs[value.__msgtype__][1]:
            yield from leaves(getattr(value, name))
    elif isinstance(value, dict):
        for item in value.values():
            yield from leaves(item)
    elif isinstance(value, list | tuple | np.ndarray):
        yield struct.pack("<d", len(value))
        for item in value:
            yield from leaves(item)
    elif hasattr(value, "__slots__") and not isinstance(value, int | float | np.generic):
        for name in value.__slots__:
            yield from leaves(getattr(value, name))
    else:
        yield struct.pack("<d", float(value))


def digests(messages: Iterable[tuple[str, Any]]) -> Digests:
    """Return count and digest of each topic of (topic, message) pairs."""
    found: dict[str, Any] = {}
    for topic, message in messages:
        entry = found.setdefault(topic, [0, hashlib.sha256()])
        entry[0] += 1
        for part in leaves(message):
            entry[1].update(part)
    return {topic: (count, digest.hexdigest()) for topic, (count, digest) in found.items()}


def ours(bag: Path) -> Digests:
    """Read a bag directory with quad_flight_log."""
    flight = open_flight(bag)

    def rows() -> Iterator[tuple[str, Any]]:
        for name in flight.topics:
            table = flight.array(name)
            for row in table[list(flight.type_of(name).fields)]:
                yield name, row

    return digests(rows())


def by_rosbags(bag: Path) -> Digests:
    """Read a bag directory with rosbags."""
    from rosbags.rosbag2 import Reader

    store = flight_samples.typestore()
    with Reader(bag) as reader:
        return digests(
            (connection.topic, store.deserialize_cdr(raw, connection.msgtype))
            for connection, _, raw in reader.messages()
        )


def by_mcap_ros2(bag: Path) -> Digests:
    """Read a bag directory with mcap and mcap-ros2-support."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    (path,) = bag.glob("*.mcap")
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return digests((item.channel.topic, item.decoded_message) for item in reader.iter_decoded_messages())
