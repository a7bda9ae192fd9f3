"""One MCAP file, read record by record with the stream reader of ``mcap``, from a closed or a cut file.

A file that ends within a record (killed recorder, full disk, cut copy) gives the messages before that place. Any other
damage is an error, unless the caller asks to salvage the messages before it.
"""

import contextlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, cast

import zstandard
from mcap import records
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.well_known import Profile

from quad_flight_log.errors import CorruptError, LimitError, NotAFlightError

LIBRARY = "quad_flight_log 2"  # how the library string of our recorder begins: its files have every checksum

_MAGIC = b"\x89MCAP0\r\n"
_ZSTD = b"\x28\xb5\x2f\xfd"  # no CDR payload begins so: rosbag2 compressed the message
_RECORD_LIMIT = 80 << 20  # bytes
_EXPANSION_LIMIT = 50  # bytes unpacked for each byte of the file; the indexes alone keep our bags below 30
_FREE_SIZE = 16 << 20  # bytes that any file may unpack to
_SEQUENCES = 1 << 32  # messages after which the numbers of our recorder begin again

Progress = Callable[[int, int], None]


class Channel(NamedTuple):
    """A topic as one file declares it; ``definition`` is the text of its type, in ``schema_encoding``."""

    topic: str
    type: str
    encoding: str
    schema_encoding: str
    definition: bytes
    type_hash: str
    offered_qos: str


class Message(NamedTuple):
    """A message as it stands in the file; times in ns."""

    channel: Channel
    log_time: int
    publish_time: int
    data: bytes


class _CutError(Exception):
    """The file ends within a record."""


class _DamageError(Exception):
    """A record is not what it should be."""


class McapFile:
    """What one file holds, known after ``messages`` was read to its end.

    ``notes``: metadata records in order. ``truncated``: the file is cut or damaged, ``damage`` says where and how.
    ``protected``: a checksum covers every message.
    """

    def __init__(self, path: Path) -> None:
        """Read nothing yet."""
        self.path = path
        self._begin()

    def _begin(self) -> None:
        self.written_by = self.damage = ""
        self.truncated, self.protected = False, True
        self.uncompressed_size = 0
        self.channels: dict[int, Channel] = {}
        self.notes: list[tuple[str, dict[str, str]]] = []
        self.attachments: dict[str, bytes] = {}
        self._schemas: dict[int, Any] = {}
        self._count = 0
        self._checked_end = False
        self._statistics: Any = None

    @property
    def own(self) -> bool:
        """Whether our recorder wrote the file."""
        return self.written_by.startswith(LIBRARY)

    def messages(self, *, salvage: bool = False, progress: Progress | None = None) -> Iterator[Message]:
        """Yield the messages in the order of the file.

        Raises NotAFlightError (no MCAP), CorruptError or LimitError; with ``salvage`` damage ends the messages.
        """
        self._begin()
        try:
            file = self.path.open("rb")
        except OSError as error:
            raise NotAFlightError(f"{self.path}: {error.strerror or error}") from error
        with file, contextlib.closing(_Stream(file, self.path, progress)) as stream:
            try:
                yield from self._read(stream)
            except NotAFlightError:
                raise
            except _CutError:
                self.truncated, self.damage = True, f"ends within a record at byte {stream.at}"
            except Exception as error:  # whatever mcap and its decompressors raise over damaged bytes
                text = str(error) if isinstance(error, _DamageError | LimitError) else _described(error)
                self.truncated, self.damage = True, f"{text} (at byte {stream.at})"
                if not salvage:
                    kind = LimitError if isinstance(error, LimitError) else CorruptError
                    raise kind(f"{self.path}: {self.damage}") from error

    def _read(self, stream: "_Stream") -> Iterator[Message]:
        ended = False
        reader = StreamReader(
            cast("Any", stream), emit_chunks=True, validate_crcs=True, record_size_limit=_RECORD_LIMIT
        )
        for record in reader.records:
            if isinstance(record, records.DataEnd):
                ended, self._checked_end = True, record.data_section_crc != 0
            elif isinstance(record, records.Statistics):
                self._statistics = record
            elif ended:  # a summary repeats what was read
                continue
            elif isinstance(record, records.Chunk):
                yield from self._chunk(record, stream.size or stream.at)
            else:
                yield from self._record(record)
        self._check_end()

    def _chunk(self, chunk: records.Chunk, file_size: int) -> Iterator[Message]:
        if chunk.compression not in ("", "zstd", "lz4"):
            raise _DamageError(f"chunk compressed as {chunk.compression!r}, expected zstd, lz4 or none")
        self.uncompressed_size += chunk.uncompressed_size
        if self.uncompressed_size > max(_FREE_SIZE, _EXPANSION_LIMIT * file_size):
            raise LimitError(f"chunks unpack to more than {_EXPANSION_LIMIT} times the size of the file")
        self.protected &= chunk.uncompressed_crc != 0
        if self.own and not chunk.uncompressed_crc:
            raise _DamageError("chunk without a checksum")
        for record in breakup_chunk(chunk, validate_crc=True):
            yield from self._record(record, in_chunk=True)

    def _record(self, record: Any, *, in_chunk: bool = False) -> Iterator[Message]:
        if isinstance(record, records.Message):
            self.protected &= in_chunk
            yield self._message(record)
        elif isinstance(record, records.Header):
            self._head(record)
        elif isinstance(record, records.Schema):
            _declare(self._schemas, record.id, record, f"schema {record.id}")
        elif isinstance(record, records.Channel):
            schema = self._schemas.get(record.schema_id)
            if record.schema_id and schema is None:
                raise _DamageError(f"channel {record.topic!r} names schema {record.schema_id}, which is not declared")
            name, encoding, text = (schema.name, schema.encoding, schema.data) if schema else ("", "", b"")
            channel = Channel(
                record.topic,
                name,
                record.message_encoding,
                encoding,
                text,
                record.metadata.get("topic_type_hash", ""),
                record.metadata.get("offered_qos_profiles", ""),
            )
            _declare(self.channels, record.id, channel, f"channel {record.id}")
        elif isinstance(record, records.Metadata):
            self.notes.append((record.name, dict(record.metadata)))
        elif isinstance(record, records.Attachment):
            self.attachments[record.name] = record.data

    def _head(self, record: records.Header) -> None:
        match record:
            case records.Header(profile=profile, library=writer):
                self.written_by = writer
        if profile not in (Profile.ROS2, ""):
            raise NotAFlightError(f"{self.path}: its profile is {profile!r}, expected ros2")

    def _message(self, record: records.Message) -> Message:
        number = record.channel_id
        if number not in self.channels:
            raise _DamageError(f"message on channel {number}, which is not declared")
        if self.own and record.sequence != self._count % _SEQUENCES:
            raise _DamageError(f"message {record.sequence}, expected {self._count}")
        self._count += 1
        data = zstandard.decompress(record.data) if record.data[:4] == _ZSTD else record.data
        return Message(self.channels[number], record.log_time, record.publish_time, data)

    def _check_end(self) -> None:
        """Compare what was read with what the writer counted."""
        if self.own and not (self._checked_end and self._statistics):
            raise _DamageError("closed without a checksum of its data or without statistics")
        if self._statistics and self._statistics.message_count != self._count:
            raise _DamageError(f"found {self._count} messages, expected {self._statistics.message_count}")


class _Stream:
    """The bytes of a file, unpacked where the file is compressed; a short read is a cut file."""

    def __init__(self, file: BinaryIO, path: Path, progress: Progress | None) -> None:
        self.at, self._progress = 0, progress
        head = file.read(len(_MAGIC))
        file.seek(0)
        self.size = 0 if head[:4] == _ZSTD else path.stat().st_size
        self._file = file if self.size or not head else zstandard.ZstdDecompressor().stream_reader(file)
        if self.size and head != _MAGIC:
            if _MAGIC.startswith(head):
                return
            raise NotAFlightError(f"{path}: starts with {head!r}, expected an MCAP file ({_MAGIC!r})")
        if not head:
            raise NotAFlightError(f"{path}: is empty, expected an MCAP file")

    def read(self, size: int) -> bytes:
        if self.size and self.at + size > self.size:
            raise _CutError
        data: bytes = self._file.read(size)
        self.at += len(data)
        if len(data) < size:
            raise _CutError
        if self._progress and self.size:
            self._progress(self.at, self.size)
        return data

    def close(self) -> None:
        if self._progress and self.size:
            self._progress(self.size, self.size)


def _declare(known: dict[int, Any], number: int, item: Any, name: str) -> None:
    if known.setdefault(number, item) != item:
        raise _DamageError(f"{name} is declared twice, differently")


def _described(error: Exception) -> str:
    text = re.sub(r"\s+", " ", str(error))[:200]
    return f"a record cannot be read ({type(error).__name__}{': ' + text if text else ''})"
