"""The files of a bag: which they are, in which order, and what is in each.

A bag is a directory as rosbag2 leaves it (one file or several, MCAP or SQLite, plain or compressed with zstd), or one
of its files. MCAP files are read record by record with the stream reader of ``mcap``, closed or cut: a file that ends
within a record (killed recorder, full disk, cut copy) gives the messages before that place. Any other damage is an
error. SQLite files are read by ``rosbags``.
"""

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, cast

import zstandard
from mcap import records
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.well_known import Profile
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import Reader

from quad_core.parameter_files import load_yaml
from quad_flight_log.errors import CorruptError, FlightLogError, one_line
from quad_flight_log.notes import LIBRARY, METADATA_FILE

_MAGIC = b"\x89MCAP0\r\n"
_ZSTD = b"\x28\xb5\x2f\xfd"  # no CDR payload begins so: rosbag2 compressed the message
_RECORD_LIMIT = 80 << 20  # bytes
_EXPANSION_LIMIT = 50  # bytes unpacked for each byte of the file; the indexes alone keep our bags below 30
_FREE_SIZE = 16 << 20  # bytes that any file may unpack to
_PACKED = {".zstd": "zstd", ".zst": "zstd", ".lz4": "lz4", ".gz": "gzip", ".bz2": "bzip2", ".xz": "xz"}
_NUMBERED = re.compile(r"(.*)_(\d+)$")
_ENCODINGS = {MessageDefinitionFormat.MSG: "ros2msg", MessageDefinitionFormat.IDL: "ros2idl"}


class Channel(NamedTuple):
    """A topic as one file declares it; ``definition`` is the text of its type, in ``schema_encoding``."""

    topic: str
    type: str
    encoding: str
    schema_encoding: str
    definition: bytes


class Message(NamedTuple):
    """A message as it stands in the file; time in ns."""

    channel: Channel
    log_time: int
    data: bytes


class _CutError(Exception):
    """The file ends within a record."""


class _DamageError(Exception):
    """A record is not what it should be."""


class BagFile:
    """One file of a bag and what it holds, known after ``messages`` was read to its end.

    ``notes``: metadata records in order. ``damage``: where the file is cut, empty for a whole one.
    """

    def __init__(self, path: Path, base: Path | None = None) -> None:
        """Read nothing yet; ``base``: the SQLite bag that is read instead, a directory or one file."""
        self.path, self._base = path, base
        self.written_by = self.damage = ""
        self.channels: dict[int, Channel] = {}
        self.notes: list[tuple[str, dict[str, str]]] = []
        self._schemas: dict[int, Any] = {}
        self._count = self._unpacked = self._file_size = 0
        self._own = False  # written by our recorder, whose files have every checksum

    def messages(self, grows: Callable[[], bool] = lambda: False) -> Iterator[Message]:
        """Yield the messages in the order of the file, once; raises FlightLogError, CorruptError for damage.

        ``grows``: asked at the end of a file that is being written, which waits and says whether more may come.
        """
        return self._mcap(grows) if self._base is None else self._sqlite(self._base)

    def _sqlite(self, base: Path) -> Iterator[Message]:
        """Yield the messages in the order of their times; the format has no checksums."""
        self.written_by = "rosbag2 (SQLite)"
        try:
            with Reader(base) as reader:
                self.channels = {connection.id: _channel(connection) for connection in reader.connections}
                for connection, time, data in reader.messages():
                    yield Message(self.channels[connection.id], time, bytes(data))
        except Exception as error:  # whatever rosbags, SQLite and zstd raise
            raise CorruptError(f"{self.path}: {one_line(error)}") from error

    def _mcap(self, grows: Callable[[], bool]) -> Iterator[Message]:
        try:
            file = self.path.open("rb")
        except OSError as error:
            raise FlightLogError(f"{self.path}: {error.strerror or error}") from error
        with file:
            stream = _Stream(file, self.path, grows)
            try:
                yield from self._read(stream)
            except FlightLogError:
                raise
            except _CutError:
                self.damage = f"ends within a record at byte {stream.at}"
            except Exception as error:  # whatever mcap and its decompressors raise over damaged bytes
                text = f"a record cannot be read ({type(error).__name__}: {one_line(error)})"
                problem = str(error) if isinstance(error, _DamageError) else text
                raise CorruptError(f"{self.path}: {problem} (at byte {stream.at})") from error

    def _read(self, stream: "_Stream") -> Iterator[Message]:
        end, statistics = None, None
        reader = StreamReader(
            cast("Any", stream), emit_chunks=True, validate_crcs=True, record_size_limit=_RECORD_LIMIT
        )
        for record in reader.records:
            self._file_size = stream.size or stream.at
            if isinstance(record, records.DataEnd):
                end = record
            elif isinstance(record, records.Statistics):
                statistics = record
            elif end:  # a summary repeats what was read
                continue
            elif isinstance(record, records.Chunk):
                yield from self._chunk(record)
            else:
                yield from self._record(record)
        if self._own and not (end and end.data_section_crc and statistics):
            raise _DamageError("closed without a checksum of its data or without statistics")
        if statistics and statistics.message_count != self._count:
            raise _DamageError(f"found {self._count} messages, expected {statistics.message_count}")

    def _unpack(self, size: int) -> None:
        """Count ``size`` bytes that are to be unpacked; raises _DamageError beyond the limits."""
        self._unpacked += size
        if size > _RECORD_LIMIT or self._unpacked > max(_FREE_SIZE, _EXPANSION_LIMIT * self._file_size):
            raise _DamageError(
                f"chunks and messages unpack to {self._unpacked} bytes and more, expected at most "
                f"{_EXPANSION_LIMIT} times the size of the file and {_RECORD_LIMIT} bytes in one"
            )

    def _chunk(self, chunk: records.Chunk) -> Iterator[Message]:
        if chunk.compression not in ("", "zstd", "lz4"):
            raise _DamageError(f"chunk compressed as {chunk.compression!r}, expected zstd, lz4 or none")
        self._unpack(chunk.uncompressed_size)
        if self._own and not chunk.uncompressed_crc:
            raise _DamageError("chunk without a checksum")
        for record in breakup_chunk(chunk, validate_crc=True):
            yield from self._record(record)

    def _record(self, record: Any) -> Iterator[Message]:
        match record:
            case records.Message():
                yield self._message(record)
            case records.Header(profile=profile, library=writer):
                self.written_by, self._own = writer, writer.startswith(LIBRARY)
                if profile not in (Profile.ROS2, ""):
                    raise FlightLogError(f"{self.path}: its profile is {profile!r}, expected ros2")
            case records.Schema():
                _declare(self._schemas, record.id, record, f"schema {record.id}")
            case records.Channel():
                _declare(self.channels, record.id, self._channel(record), f"channel {record.id}")
            case records.Metadata():
                self.notes.append((record.name, dict(record.metadata)))

    def _channel(self, record: records.Channel) -> Channel:
        schema = self._schemas.get(record.schema_id)
        if record.schema_id and schema is None:
            raise _DamageError(f"channel {record.topic!r} names schema {record.schema_id}, which is not declared")
        name, encoding, text = (schema.name, schema.encoding, schema.data) if schema else ("", "", b"")
        return Channel(record.topic, name, record.message_encoding, encoding, text)

    def _message(self, record: records.Message) -> Message:
        number = record.channel_id
        if number not in self.channels:
            raise _DamageError(f"message on channel {number}, which is not declared")
        if self._own and record.sequence != self._count:
            raise _DamageError(f"message {record.sequence}, expected {self._count}")
        self._count += 1
        data = record.data
        if data[:4] == _ZSTD:
            self._unpack(zstandard.frame_content_size(data))  # -1, where the frame does not say it, is refused below
            data = zstandard.decompress(data)
        time = record.log_time
        return Message(self.channels[number], time - (time >> 63 << 64), data)  # below 0 a recorder's clock rolled over


def _channel(connection: Any) -> Channel:
    encoding, text = _ENCODINGS.get(connection.msgdef.format, ""), connection.msgdef.data.encode()
    return Channel(connection.topic, connection.msgtype, "cdr", encoding, text)


class _Stream:
    """The bytes of a file, unpacked where the file is compressed; a short read is a cut file."""

    def __init__(self, file: BinaryIO, path: Path, grows: Callable[[], bool]) -> None:
        self.at, self._grows, self._descriptor = 0, grows, file.fileno()
        head = file.read(len(_MAGIC))
        file.seek(0)
        if not head:
            raise FlightLogError(f"{path}: is empty, expected an MCAP file")
        self.size = 0 if head[:4] == _ZSTD else path.stat().st_size
        self._file = file if self.size else zstandard.ZstdDecompressor().stream_reader(file)
        if self.size and not _MAGIC.startswith(head):
            raise FlightLogError(f"{path}: starts with {head!r}, expected an MCAP file ({_MAGIC!r})")

    def read(self, size: int) -> bytes:
        while self.size and self.at + size > self.size:
            more = self._grows()
            self.size = os.fstat(self._descriptor).st_size
            if not more and self.at + size > self.size:
                raise _CutError
        data: bytes = self._file.read(size)
        self.at += len(data)
        if len(data) < size:
            raise _CutError
        return data


def _declare(known: dict[int, Any], number: int, item: Any, name: str) -> None:
    if known.setdefault(number, item) != item:
        raise _DamageError(f"{name} is declared twice, differently")


def files_of(path: Path) -> tuple[list[BagFile], list[str]]:
    """Return the files of a bag in order, and the names that ``metadata.yaml`` lists and that are not there.

    Raises FlightLogError where no file is there or readable.
    """
    if path.is_file():
        return ([_file(path)], [])
    if not path.is_dir():
        raise FlightLogError(f"{path}: no such file or directory")
    seen = (each for each in path.iterdir() if not each.name.startswith("."))  # ._NAME: of macOS
    found = [each for each in seen if {".mcap", ".db3"} & set(each.suffixes) and each.is_file()]
    if not found:
        raise FlightLogError(f"{path}: no *.mcap and no *.db3 in it, expected a bag directory")
    listed = _listed(path)
    here = {each.name: each for each in sorted(found, key=_place)}
    known = [name for name in listed if name in here]
    names = known or list(here)
    places = [_place(here[name]) for name in names]
    if not known and (len({stem for stem, _ in places}) > 1 or len(set(places)) < len(places)):
        raise FlightLogError(f"{path}: holds {', '.join(names)}; expected one bag, name the file to read")
    missing = [name for name in listed if name not in here] if known else []
    first = here[names[0]]
    if ".db3" in first.suffixes:
        return ([BagFile(first, path if listed else first)], missing)
    return ([_file(here[name]) for name in names], missing)


def _file(path: Path) -> BagFile:
    packed = _PACKED.get(path.suffix, "")
    if packed not in ("", "zstd"):
        raise FlightLogError(f"{path}: compressed with {packed}, expected zstd or none: unpack the file first")
    if ".db3" not in path.suffixes:
        return BagFile(path)
    if packed:
        raise FlightLogError(f"{path}: a compressed SQLite file is read with its metadata.yaml: name the directory")
    return BagFile(path, path)


def _place(path: Path) -> tuple[str, int]:
    """Return by what the files of a bag are ordered: their common name and their number."""
    stem = path.name.partition(".mcap")[0].partition(".db3")[0]
    match = _NUMBERED.match(stem)
    return (match[1], int(match[2])) if match else (stem, 0)


def _listed(directory: Path) -> list[str]:
    """Return the files that metadata.yaml lists, none where it cannot be read."""
    try:
        about = load_yaml((directory / METADATA_FILE).read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
        names = [Path(name).name for name in about["relative_file_paths"]]
        kind, mode = about.get("compression_format") or "", about.get("compression_mode") or ""
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return []
    if kind not in ("", "zstd"):
        raise FlightLogError(f"{directory}: found {kind!r} ({mode}), expected zstd or none: use `ros2 bag convert`")
    return names
