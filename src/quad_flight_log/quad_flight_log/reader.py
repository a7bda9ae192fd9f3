"""A recorded flight as NumPy arrays, read without ROS.

``open_flight`` reads the whole bag once and compares every checksum; arrays are decoded when asked for. A topic may be
named relative (``truth``) or in full (``/truth``, ``/uav1/truth``).
"""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.well_known import MessageEncoding, SchemaEncoding
from numpy.typing import NDArray

from quad_core.rich_display import flight_html
from quad_flight_log.errors import FlightLogError, SchemaError, TopicError
from quad_flight_log.files import Channel, files_of
from quad_flight_log.messages import MessageType, Table, known_type, message_type
from quad_flight_log.notes import LIBRARY, QUAD, QUAD_END, opened_notes

MEMORY_LIMIT = 4 << 30  # bytes of payload that a bag may hold: all of it is kept in memory

Rows = tuple[list[bytes], list[int]]  # CDR payloads and log times in ns of one topic


class Topic(NamedTuple):
    """One topic of a bag. ``name`` is full, ``size`` in payload bytes, ``first`` and ``last`` are log times in ns."""

    name: str
    type: str
    messages: int
    size: int
    first: int
    last: int


class Flight:
    """A verified flight log.

    ``path``: its first file. ``topics``: {full name: Topic}. ``metadata``: what the recorder noted (run id, seed,
    versions, drops, ...). ``truncated``: the bag is cut or lacks a file and what is here is its verified beginning;
    ``damage`` says where. ``unreadable``: {topic: why} of topics whose definition or encoding is not one that can be
    decoded (their bytes still are in ``payloads``).
    """

    def __init__(self, path: Path, namespace: str = "") -> None:
        """Read the bag at ``path`` once; raises as ``open_flight``."""
        self._files, missing = files_of(path)
        self.path = self._files[0].path
        self._rows: dict[str, Rows] = {}
        self._cache: dict[str, Table] = {}
        self.topics: dict[str, Topic] = {}
        self._read_all()
        self.written_by = self._files[0].written_by
        self.size = sum(file.path.stat().st_size for file in self._files)
        damage = [file.damage for file in self._files if file.damage] + [f"{name} is missing" for name in missing]
        self.damage, self.truncated = "; ".join(damage), bool(damage)
        self.metadata = self._notes()
        only = self.vehicles[0] if len(self.vehicles) == 1 else ""
        vehicle = (namespace or self.metadata.get("namespace", "") or only).strip("/")
        self.namespace = f"/{vehicle}" if vehicle else ""
        self.unreadable: dict[str, str] = {}
        self._types: dict[str, MessageType] = {}
        self._find_types()

    @property
    def name(self) -> str:
        """What the flight is called in tables: its bag directory, else its file."""
        folder = self.path.parent.name
        return folder if self.path.name.startswith(f"{folder}_0.") else self.path.name

    @property
    def vehicles(self) -> list[str]:
        """The namespaces in which the bag has the state or truth of a vehicle, the global one as an empty text."""
        found = {name.rpartition("/")[0] for name, topic in self.topics.items() if topic.type.endswith("/VehicleState")}
        return sorted(found)

    def has(self, topic: str) -> bool:
        """Return whether the bag has at least one message of a topic; raises FlightLogError as ``resolve``."""
        try:
            return self.topics[self.resolve(topic)].messages > 0
        except TopicError:
            return False

    def resolve(self, topic: str) -> str:
        """Return the full name of a topic given in full or relative to the namespace of the flight.

        Raises TopicError if it is missing, FlightLogError if there are several vehicles and no namespace was given.
        """
        relative = topic.lstrip("/")
        for name in (topic, f"{self.namespace}/{relative}"):
            if name in self.topics:
                return name
        if len(self.vehicles) > 1 and not self.namespace and not topic.startswith("/"):
            names = ", ".join(name.strip("/") or "/" for name in self.vehicles)
            raise FlightLogError(f"{self.path}: topic {topic!r} of several vehicles: name a namespace: {names}")
        have = ", ".join(self.topics) or "no topics"
        option = "; --namespace names another" if any(name.endswith(f"/{relative}") for name in self.topics) else ""
        where = f"in namespace {self.namespace or '/'}{option}"
        raise TopicError(f"{self.path}: no topic {topic!r} {where}; the bag has {have}")

    def without_topics(self, so: str) -> TopicError:
        """Return the error for a bag without any topic of a flight; ``so``: what follows from it."""
        where = f"in namespace {self.namespace or '/'}; --namespace names another"
        return TopicError(f"{self.path}: holds no topic of a flight {where}: {so}")

    def array(self, topic: str) -> Table:
        """Return all messages of a topic in the order of the bag, shape (n,).

        Fields: ``log_ns`` (time of recording), ``stamp_ns`` (message stamp; left out where the type lacks it), then the
        message's own. Raises TopicError or SchemaError.
        """
        name = self.resolve(topic)
        if name not in self._cache:
            self._cache[name] = self.type_of(name).table(*self._rows[name], f"{self.path}: {name}")
        return self._cache[name]

    def payloads(self, *topics: str) -> dict[str, Rows]:
        """Return {full name: (CDR payloads, log times in ns)} of topics, in the order of the bag."""
        return {name: self._rows[name] for name in map(self.resolve, topics)}

    def type_of(self, topic: str) -> MessageType:
        """Return the type of a topic, as the bag defines it; SchemaError if it cannot be read."""
        name = self.resolve(topic)
        if name in self.unreadable:
            raise SchemaError(self.unreadable[name])
        return self._types[name]

    def _repr_html_(self) -> str:
        """Return what a notebook shows: what the recorder noted, and the path."""
        shown = ("outcome", "reason", "command", "seed", "started", "git_commit")
        rows = {"bag": self.name, "damage": self.damage} | {name: self.metadata.get(name, "") for name in shown}
        rows["messages"] = str(sum(topic.messages for topic in self.topics.values()))
        flown = self._places("truth")
        flown = flown if len(flown) else self._places("state")
        return flight_html({name: value for name, value in rows.items() if value}, flown, self._places("reference"))

    def _places(self, topic: str) -> NDArray[np.float64]:
        """Return p_w (n, 3) in m of a topic, none where it cannot be read."""
        with suppress(FlightLogError, KeyError, ValueError):
            return np.asarray(self.array(topic)["p_w"], dtype=float)
        return np.zeros((0, 3))

    def _channels(self) -> Iterator[Channel]:
        return (channel for file in self._files for channel in file.channels.values())

    def _read_all(self) -> None:
        size = 0
        for message in (each for file in self._files for each in file.messages()):
            size += len(message.data)
            if size > MEMORY_LIMIT:
                raise FlightLogError(f"{self.path}: too large: found more than {MEMORY_LIMIT} bytes of payload")
            payloads, times = self._rows.setdefault(message.channel.topic, ([], []))
            payloads.append(message.data)
            times.append(message.log_time)
        for channel in sorted(self._channels(), key=lambda each: each.topic):
            payloads, times = self._rows.setdefault(channel.topic, ([], []))
            span = (min(times, default=0), max(times, default=0))
            topic = Topic(channel.topic, channel.type, len(payloads), sum(map(len, payloads)), *span)
            self.topics.setdefault(channel.topic, topic)

    def _notes(self) -> dict[str, str]:
        merged: dict[str, str] = {}
        for file in self._files:
            for name, values in (note for note in file.notes if note[0] in (QUAD, QUAD_END)):
                where, strict = f"{self.path}: metadata record {name!r}", file.written_by.startswith(LIBRARY)
                merged.update(opened_notes(values, where, strict=strict))
        return merged

    def _find_types(self) -> None:
        for channel in self._channels():
            name, where = channel.topic, f"{self.path}: {channel.topic}"
            try:
                kind = _type_of(channel)
                if not self._types.setdefault(name, kind).same_fields(kind):
                    raise SchemaError("two definitions of one topic, whose fields differ")
            except SchemaError as error:
                self.unreadable.setdefault(name, f"{where}: {error}")


def _type_of(channel: Channel) -> MessageType:
    if channel.encoding != MessageEncoding.CDR:
        raise SchemaError(f"found messages in {channel.encoding!r}, expected {MessageEncoding.CDR!r}")
    if channel.schema_encoding == SchemaEncoding.ROS2:
        return message_type(channel.type, channel.definition.decode("utf-8", errors="replace"))
    if channel.schema_encoding or not channel.type:
        found = channel.schema_encoding or "no definition"
        raise SchemaError(f"found {found!r}, expected a definition in {SchemaEncoding.ROS2!r}")
    return known_type(channel.type)


def open_flight(path: str | Path, *, namespace: str = "") -> Flight:
    """Open a bag directory or one of its files, and verify it.

    Bags of rosbag2 may be split, SQLite, or compressed with zstd. A file that was not closed is read up to where it
    ends (``truncated``). Raises FlightLogError for what is no bag or holds more than MEMORY_LIMIT bytes of payload,
    CorruptError for a damaged one.
    """
    return Flight(Path(path), namespace)
