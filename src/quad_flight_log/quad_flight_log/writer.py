"""Writes a rosbag2 bag (one MCAP file and ``metadata.yaml``) without ROS, so that a killed process loses little.

Callers only append to a queue. One thread moves the queue into the file and flushes it, another makes the disk keep
it. The file is called ``*.mcap.part`` until it is closed.
"""

import contextlib
import os
import threading
import time
from collections import Counter, deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer

from quad_flight_log.errors import FlightLogError
from quad_flight_log.notes import (
    LIBRARY,
    METADATA_FILE,
    QUAD,
    QUAD_END,
    as_yaml,
    bag_metadata,
    qos_profile,
    sealed_notes,
    topic_metadata,
)

DRAIN_PERIOD = 0.05  # s between two moves of the queue into the file
FLUSH_PERIOD = 0.2  # s between two chunks; with the above less than 300 ms are lost with the process
CHUNK_SIZE = 256 << 10  # bytes of a chunk before it is compressed
SYNC_PERIOD = 1.0  # s; less than 1.5 s are lost with the machine
BACKLOG_LIMIT = 64 << 20  # bytes waiting for a slow disk before messages are dropped
MESSAGE_LIMIT = 1 << 20  # bytes of one message; the largest of a flight, its parameters, have some 50,000


class Definition(NamedTuple):
    """One message type: ``pkg/msg/Type``, its text with all dependencies, its REP-2016 hash (empty: unknown)."""

    name: str
    text: str
    type_hash: str


class BagWriter:
    """One recording into a new directory.

    ``metadata`` is written first, so that it survives a kill. ``write`` never blocks
    on the disk. The first error of the disk ends the recording, and is its ``error``; everything before it stays
    readable. ``path`` is the file, ``dropped`` {topic: messages that did not enter it}, ``messages`` those that did.
    """

    def __init__(
        self,
        directory: str | Path,
        *,
        metadata: Mapping[str, str] | None = None,
        flush_period: float = FLUSH_PERIOD,
        backlog_limit: int = BACKLOG_LIMIT,
    ) -> None:
        """Create the bag; raises FlightLogError if the directory exists and is not empty, or cannot be written."""
        self.directory = Path(directory).absolute()
        self.path = self.directory / f"{self.directory.name}_0.mcap.part"
        self.error = ""
        self.dropped: Counter[str] = Counter()
        self._custom = dict(metadata or {})
        self._flush_period, self._backlog_limit = flush_period, backlog_limit
        self._topics: list[dict[str, Any]] = []
        self._channels: list[int] = []
        self._schemas: dict[str, int] = {}
        self._queue: deque[tuple[int, int, int, bytes]] = deque()
        self._queued_size = 0
        self._taken_size = 0
        self._flushes = self.messages = 0
        self._start_ns = self._end_ns = -1
        self._lock = threading.Lock()
        self._closing = threading.Event()
        try:
            self._stream = self._create()
            self._writer = Writer(
                self._stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD, enable_data_crcs=True
            )
            self._writer.start(profile="ros2", library=f"{LIBRARY} with mcap")
            self._writer.add_metadata(QUAD, sealed_notes(self._custom))
            self._writer.flush()
        except OSError as error:
            raise FlightLogError(f"{self.directory}: cannot record here: {error.strerror or error}") from error
        self._threads = [
            threading.Thread(target=self._drain_loop, name="bag-writer", daemon=True),
            threading.Thread(target=self._sync_loop, name="bag-sync", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def backlog(self) -> int:
        """Bytes that wait for the disk; none after it failed, so that no node waits for it."""
        return 0 if self.error else self._queued_size - self._taken_size

    def add_topic(self, name: str, definition: Definition, *, latched: bool = False) -> int:
        """Declare a topic (full name) and return its handle."""
        profile = qos_profile(latched=latched)
        with self._lock:
            schema = self._schemas.get(definition.name)
            if schema is None:
                schema = self._writer.register_schema(definition.name, SchemaEncoding.ROS2, definition.text.encode())
                self._schemas[definition.name] = schema
            extra = {"offered_qos_profiles": as_yaml([profile]), "topic_type_hash": definition.type_hash}
            self._channels.append(self._writer.register_channel(name, MessageEncoding.CDR, schema, extra))
            self._topics.append(topic_metadata(name, definition.name, definition.type_hash, profile))
        return len(self._topics) - 1

    def write(self, topic: int, payload: bytes, log_ns: int, publish_ns: int | None = None) -> bool:
        """Queue one message (CDR bytes with their encapsulation header); returns whether it was taken.

        ``log_ns`` orders the bag; ``publish_ns`` defaults to it. Refused messages are counted per topic in ``dropped``;
        one beyond MESSAGE_LIMIT would make a chunk that no careful reader unpacks.
        """
        stopped = self.error or self._closing.is_set()
        if stopped or self.backlog > self._backlog_limit or len(payload) > MESSAGE_LIMIT:
            self.refuse(topic)
            return False
        self._queued_size += len(payload)
        self._queue.append((topic, log_ns, log_ns if publish_ns is None else publish_ns, payload))
        return True

    def refuse(self, topic: int) -> None:
        """Count a message that does not enter the bag."""
        self.dropped[self._topics[topic]["topic_metadata"]["name"]] += 1

    def close(self, metadata: Mapping[str, str] | None = None) -> None:
        """Write what is left, close, rename and write metadata.yaml. ``metadata`` is noted at the end.

        With an ``error`` the file keeps its name ``*.part`` and may hold less than was written.
        """
        if self._stream.closed:
            return
        self._closing.set()
        for thread in self._threads:
            thread.join()
        if not self.error:
            self._finish(dict(metadata or {}))
        with contextlib.suppress(OSError):  # what a full disk did not take at the end
            self._stream.close()

    def _create(self) -> BinaryIO:
        self.directory.mkdir(parents=True, exist_ok=True)
        # what the nodes of scripts/fly print is there already
        found = next((path for path in sorted(self.directory.iterdir()) if path.name != "logs"), None)
        if found is not None:
            raise FlightLogError(f"{self.directory}: holds {found.name} already; a recording is never overwritten")
        return self.path.open("xb")

    def _drain_loop(self) -> None:
        flushed, fresh = time.monotonic(), False
        while not self.error:
            closing = self._closing.wait(DRAIN_PERIOD)
            try:
                with self._lock:
                    fresh = self._drain() or fresh
                    if closing or (fresh and time.monotonic() - flushed >= self._flush_period - DRAIN_PERIOD):
                        self._writer.flush()
                        flushed, fresh = time.monotonic(), False
                        self._flushes += 1
            except Exception as error:
                # Whatever it is: a thread that died unseen would leave a bag that only seems to grow.
                self._give_up(error)
            if closing:
                return

    def _sync_loop(self) -> None:
        try:
            synced = -1
            while not self.error and not self._closing.wait(SYNC_PERIOD):
                if synced != self._flushes:
                    synced = self._flushes
                    os.fsync(self._stream.fileno())
        except OSError as error:
            self._give_up(error)

    def _drain(self) -> bool:
        """Move what waits into the file; returns whether there was anything."""
        add, queue = self._writer.add_message, self._queue
        waiting = len(queue)
        for _ in range(waiting):
            topic, log_ns, publish_ns, payload = queue.popleft()
            self._topics[topic]["message_count"] += 1
            add(self._channels[topic], log_ns, payload, publish_ns, self.messages)
            self.messages += 1
            self._taken_size += len(payload)
            if self._start_ns < 0 or log_ns < self._start_ns:
                self._start_ns = log_ns
            self._end_ns = max(self._end_ns, log_ns)
        return waiting > 0

    def _give_up(self, error: Exception) -> None:
        self.error = f"{self.path}: {getattr(error, 'strerror', None) or error}"

    def _finish(self, last: dict[str, str]) -> None:
        counted = {f"dropped.{name}": str(count) for name, count in sorted(self.dropped.items())}
        last = {**last, "messages": str(self.messages), "dropped": str(sum(self.dropped.values())), **counted}
        start, end = max(self._start_ns, 0), max(self._end_ns, 0)
        closed = self.path.with_suffix("")
        about = bag_metadata(closed.name, self._topics, start, end, {**self._custom, **last})
        try:
            self._writer.flush()
            self._writer.add_metadata(QUAD_END, sealed_notes(last))
            self._writer.finish()
            self._stream.flush()
            os.fsync(self._stream.fileno())
            self.path = self.path.rename(closed)
            text = as_yaml({"rosbag2_bagfile_information": about})
            (self.directory / METADATA_FILE).write_text(text, encoding="utf-8")
        except OSError as error:
            self.error = f"{self.path}: {error.strerror or error}"
