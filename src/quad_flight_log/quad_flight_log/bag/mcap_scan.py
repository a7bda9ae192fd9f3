"""MCAP files read with every check that the format allows, bounded in memory, tolerant only of a cut end.

A file that ends in the middle of a record (a killed recorder, a full disk, a cut copy) is read as the prefix that was
verified. Anything else that is wrong is an error, unless the caller asks to salvage the verified prefix.
"""

import os
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from quad_flight_log.bag.mcap_records import (
    RECORD,
    RECORD_LIMIT,
    BadRecordError,
    CutError,
    next_record,
    parsed,
    unpacked_chunk,
    walk,
)
from quad_flight_log.errors import CorruptError, LimitError, NotAFlightError

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "quad_flight_log"  # how our header's library string begins: such files carry a checksum everywhere

EXPANSION_LIMIT = 50  # bytes unpacked for each byte of a file; the indexes alone keep our bags below 30
FREE_SIZE = 16 << 20  # bytes that any file may unpack to

_INDEX_HEAD = 6  # bytes before the entries of a message index
_INDEX_ENTRY = 16
_PRIVATE = 0x80  # first opcode that the format leaves to applications
_INDEXES: dict[int, Callable[[ReadDataStream], Any]] = {
    Opcode.CHUNK_INDEX: records.ChunkIndex.read,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex.read,
    Opcode.METADATA_INDEX: records.MetadataIndex.read,
    Opcode.SUMMARY_OFFSET: records.SummaryOffset.read,
}


@dataclass
class Tally:
    """What a channel holds."""

    count: int = 0
    size: int = 0
    first: int = 0
    last: int = 0


@dataclass
class Scan:
    """What a verified pass over a file found. ``end`` is where the verified prefix ends, in bytes."""

    path: Path
    profile: str = ""
    written_by: str = ""
    schemas: dict[int, Any] = field(default_factory=dict)
    channels: dict[int, Any] = field(default_factory=dict)
    tallies: dict[int, Tally] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    chunk_channels: dict[int, frozenset[int]] = field(default_factory=dict)
    statistics: Any = None
    end: int = 0
    truncated: bool = False
    damage: str = ""
    protected: bool = True
    compressed_size: int = 0
    uncompressed_size: int = 0

    @property
    def own(self) -> bool:
        """Whether our recorder wrote the file."""
        return self.written_by.startswith(LIBRARY)


def scan(path: Path, *, salvage: bool = False, progress: Callable[[int, int], None] | None = None) -> Scan:
    """Read and verify the whole file once; nothing but counts, schemas and metadata is kept.

    ``progress`` is called with (bytes read, bytes in all). Raises NotAFlightError (no MCAP), CorruptError, LimitError.
    With ``salvage`` damage ends the prefix and is named in ``Scan.damage``.
    """
    found = Scan(path)
    try:
        stream = path.open("rb")
    except OSError as error:
        raise NotAFlightError(f"{path}: {error.strerror or error}") from error
    with stream:
        size = os.fstat(stream.fileno()).st_size
        head = stream.read(len(MAGIC))
        if head != MAGIC:
            if head and MAGIC.startswith(head):
                found.truncated, found.damage = True, "ends within its first 8 bytes"
                return found
            raise NotAFlightError(f"{path}: starts with {head!r}, expected an MCAP file ({MAGIC!r})")
        try:
            _Pass(found, stream, size, progress).run()
        except CutError:
            found.truncated = True
            found.damage = f"ends within a record at byte {found.end} of {size}"
        except (BadRecordError, LimitError) as error:
            found.truncated = True
            found.damage = f"{error} (at byte {found.end} of {size})"
            if not salvage:
                kind = LimitError if isinstance(error, LimitError) else CorruptError
                raise kind(f"{path}: {found.damage}") from error
        finally:
            if progress:
                progress(size, size)
    return found


class _Pass:
    """One pass over the records, with the running checksums of the data and the summary section."""

    def __init__(self, found: Scan, stream: BinaryIO, size: int, progress: Callable[[int, int], None] | None) -> None:
        self.found, self.stream, self.size, self.progress = found, stream, size, progress
        self.crc = zlib.crc32(MAGIC)
        self.in_data = True
        self.noted_size = 0
        self.sets: dict[frozenset[int], frozenset[int]] = {}  # most chunks hold the same channels: one object for all
        found.end = len(MAGIC)

    def run(self) -> None:
        while True:
            opcode, body, head = next_record(self.stream, self.size, self.found.end)
            if self.found.end == len(MAGIC) and opcode != Opcode.HEADER:
                raise BadRecordError(f"first record has opcode {opcode:#04x}, expected the header")
            if opcode == Opcode.FOOTER:
                self.footer(body, head)
                return
            if opcode == Opcode.DATA_END:
                self.data_end(body)
            else:
                self.record(opcode, body)
                self.crc = zlib.crc32(body, zlib.crc32(head, self.crc))
            self.found.end += len(head) + len(body)
            if self.progress:
                self.progress(self.found.end, self.size)

    def data_end(self, body: bytes) -> None:
        expected = parsed(records.DataEnd.read, body, "data end").data_section_crc
        if not self.in_data:
            raise BadRecordError("second end of data")
        if expected != self.crc and (expected or self.found.own):
            raise BadRecordError(f"checksum of the data section is {self.crc:#010x}, expected {expected:#010x}")
        self.in_data, self.crc = False, 0

    def footer(self, body: bytes, head: bytes) -> None:
        footer = parsed(records.Footer.read, body, "footer")
        if self.in_data:
            raise BadRecordError("footer before the end of data")
        crc = zlib.crc32(body[:-4], zlib.crc32(head, self.crc))
        if footer.summary_crc != crc and (footer.summary_crc or self.found.own):
            raise BadRecordError(f"checksum of the summary is {crc:#010x}, expected {footer.summary_crc:#010x}")
        tail = self.stream.read(len(MAGIC) + 1)
        if tail != MAGIC:
            if MAGIC.startswith(tail):
                raise CutError
            raise BadRecordError("bytes after the footer are not the closing magic")
        self.found.end = self.size
        self.compare_statistics()

    def compare_statistics(self) -> None:
        statistics = self.found.statistics
        if statistics is None:
            if self.found.own:
                raise BadRecordError("summary without statistics")
            return
        counted = {number: tally.count for number, tally in self.found.tallies.items() if tally.count}
        expected = {number: count for number, count in statistics.channel_message_counts.items() if count}
        if statistics.message_count != sum(counted.values()) or (expected and expected != counted):
            raise BadRecordError(f"found {sum(counted.values())} messages, expected {statistics.message_count}")

    def record(self, opcode: int, body: bytes) -> None:
        found = self.found
        if opcode == Opcode.CHUNK:
            self.chunk(body)
        elif opcode == Opcode.HEADER and found.end == len(MAGIC):
            match parsed(records.Header.read, body, "header"):
                case records.Header(profile=profile, library=library):
                    found.profile, found.written_by = profile, library
        elif opcode == Opcode.METADATA:
            item = parsed(records.Metadata.read, body, "metadata")
            if self.in_data:
                found.metadata.append((item.name, item.metadata))
                self.keep(body)
        elif opcode == Opcode.ATTACHMENT:
            item = parsed(records.Attachment.read, body, "attachment")
            (expected,) = struct.unpack("<I", body[-4:])
            if expected != zlib.crc32(body[:-4]) and (expected or found.own):
                raise BadRecordError(f"checksum of attachment {item.name!r} does not fit")
            found.attachments[item.name] = item.data
            self.keep(body)
        elif opcode == Opcode.STATISTICS:
            found.statistics = parsed(records.Statistics.read, body, "statistics")
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            self.outside_chunk(opcode, body)
        elif opcode == Opcode.MESSAGE_INDEX:
            _check_message_index(body)
        elif opcode in _INDEXES:
            parsed(_INDEXES[opcode], body, Opcode(opcode).name.lower())
        elif opcode < _PRIVATE or found.own:
            raise BadRecordError(f"record with unknown opcode {opcode:#04x}")

    def keep(self, body: bytes) -> None:
        self.noted_size += len(body)
        if self.noted_size > RECORD_LIMIT:
            raise LimitError(f"more than {RECORD_LIMIT} bytes of metadata and attachments")

    def outside_chunk(self, opcode: int, body: bytes) -> None:
        if self.in_data and self.found.own:
            raise BadRecordError("message, schema or channel outside a chunk")
        if opcode == Opcode.MESSAGE:
            if not self.in_data:
                raise BadRecordError("message after the end of data")
            self.found.protected = False
        framed = RECORD.pack(opcode, len(body)) + body
        define = _definer(self.found)
        for channel, log_time, _, start, end in walk(framed, define):
            self.count(channel, log_time, end - start)

    def chunk(self, body: bytes) -> None:
        if not self.in_data:
            raise BadRecordError("chunk after the end of data")
        data, protected = unpacked_chunk(body, self.found.own)
        self.found.protected &= protected
        self.found.compressed_size += len(body)
        self.found.uncompressed_size += len(data)
        if self.found.uncompressed_size > max(FREE_SIZE, EXPANSION_LIMIT * self.size):
            raise LimitError(f"chunks unpack to more than {EXPANSION_LIMIT} times the size of the file")
        define = _definer(self.found)
        present = set()
        for channel, log_time, _, start, end in walk(data, define):
            present.add(channel)
            self.count(channel, log_time, end - start)
        known = frozenset(present)
        self.found.chunk_channels[self.found.end] = self.sets.setdefault(known, known)

    def count(self, channel: int, log_time: int, size: int) -> None:
        tally = self.found.tallies.get(channel)
        if tally is None:
            if channel not in self.found.channels:
                raise BadRecordError(f"message on channel {channel}, which is not declared")
            tally = self.found.tallies[channel] = Tally(first=log_time, last=log_time)
        tally.count += 1
        tally.size += size
        if log_time > tally.last:
            tally.last = log_time
        elif log_time < tally.first:
            tally.first = log_time


def _check_message_index(body: bytes) -> None:
    """Check the shape only: the entries are not used, and reading them one by one takes as long as all the messages."""
    size = struct.unpack_from("<HI", body)[1] if len(body) >= _INDEX_HEAD else -1
    if size != len(body) - _INDEX_HEAD or size % _INDEX_ENTRY:
        raise BadRecordError(f"message index record of {len(body)} bytes has no whole entries")


def _definer(found: Scan) -> Callable[[int, bytes], None]:
    def define(opcode: int, body: bytes) -> None:
        kind, known = (records.Schema, found.schemas) if opcode == Opcode.SCHEMA else (records.Channel, found.channels)
        item = parsed(kind.read, body, kind.__name__.lower())
        if known.setdefault(item.id, item) != item:
            raise BadRecordError(f"{kind.__name__.lower()} {item.id} is declared twice, differently")
        if opcode == Opcode.CHANNEL and item.schema_id and item.schema_id not in found.schemas:
            raise BadRecordError(f"channel {item.topic!r} names schema {item.schema_id}, which is not declared")

    return define
