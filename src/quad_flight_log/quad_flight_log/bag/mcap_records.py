"""Single MCAP records, each checked as far as the format allows. Used by ``mcap_scan`` and ``flat_writer``."""

import io
import struct
import zlib
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from quad_flight_log.errors import LimitError

CHUNK_LIMIT = 64 << 20  # bytes of one chunk, uncompressed
RECORD_LIMIT = 80 << 20  # bytes of one record in the file

RECORD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
CHUNK_HEAD = struct.Struct("<QQQII")


class CutError(Exception):
    """The file ends here, in the middle of a record."""


class BadRecordError(Exception):
    """A record is not what it should be."""


def next_record(stream: BinaryIO, size: int, offset: int) -> tuple[int, bytes, bytes]:
    """Return (opcode, body, head) of the record at ``offset``, where the stream stands."""
    head = stream.read(RECORD.size)
    if len(head) < RECORD.size:
        raise CutError
    opcode, length = RECORD.unpack(head)
    if opcode == 0:
        # A power loss can leave a tail of zeros; any other byte there is damage.
        block = head
        while block:
            if block.count(0) != len(block):
                raise BadRecordError("record with opcode 0")
            block = stream.read(1 << 20)
        raise CutError
    if offset + RECORD.size + length > size:
        raise CutError
    if length > RECORD_LIMIT:
        raise LimitError(f"record of {length} bytes, more than the {RECORD_LIMIT} that are read")
    body = stream.read(length)
    if len(body) < length:
        raise CutError
    return opcode, body, head


def parsed(read: Callable[[ReadDataStream], Any], body: bytes, what: str) -> Any:
    """Return the record that ``read`` makes of ``body``, which it must use up to the last byte."""
    source = io.BytesIO(body)
    try:
        item = read(ReadDataStream(source))
    except Exception as error:
        raise BadRecordError(f"{what} record cannot be read ({type(error).__name__})") from error
    if source.tell() != len(body):
        raise BadRecordError(f"{what} record is {len(body)} bytes long, expected {source.tell()}")
    return item


def unpacked_chunk(body: bytes, strict: bool) -> tuple[bytes, bool]:
    """Return (records, whether a checksum covers them) of a chunk record."""
    try:
        _, _, size, crc, name_length = CHUNK_HEAD.unpack_from(body)
        at = CHUNK_HEAD.size + name_length
        compression = body[CHUNK_HEAD.size : at]
        (length,) = struct.unpack_from("<Q", body, at)
    except struct.error as error:
        raise BadRecordError("chunk record is too short") from error
    packed = memoryview(body)[at + 8 :]
    if length != len(packed):
        raise BadRecordError(f"chunk announces {length} bytes and has {len(packed)}")
    if size > CHUNK_LIMIT:
        raise LimitError(f"chunk of {size} bytes uncompressed, more than the {CHUNK_LIMIT} that are read")
    data = _decompressed(compression, packed, size)
    if len(data) != size:
        raise BadRecordError(f"chunk unpacks to {len(data)} bytes, expected {size}")
    if (crc or strict) and zlib.crc32(data) != crc:
        raise BadRecordError("checksum of a chunk does not fit")
    return data, crc != 0


def _decompressed(compression: bytes, packed: memoryview, size: int) -> bytes:
    if compression == b"":
        return bytes(packed)
    try:
        if compression == b"zstd":
            # The size in the frame decides how much zstd allocates, so it is compared first.
            announced = zstandard.frame_content_size(packed)
            if announced > size:
                raise BadRecordError(f"zstd frame of {announced} bytes, expected {size}")
            return bytes(zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)) if size else b""
        if compression == b"lz4":
            from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]

            return bytes(LZ4FrameDecompressor().decompress(packed, max_length=size + 1))
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise BadRecordError(f"chunk cannot be unpacked ({error})") from error
    except ImportError as error:
        raise BadRecordError("chunk is compressed with lz4: install the Python package lz4") from error
    raise BadRecordError(f"chunk compression {compression!r} is unknown, expected zstd, lz4 or none")


def walk(data: bytes, define: Callable[[int, bytes], None] | None) -> Iterator[tuple[int, int, int, int, int]]:
    """Yield (channel, log time, publish time, start, end) of every message in the records of a chunk.

    Schemas and channels go to ``define``. Raises when a record does not fit into the chunk.
    """
    at, size = 0, len(data)
    unpack_record, unpack_message = RECORD.unpack_from, MESSAGE_HEAD.unpack_from
    head, message_head, message_opcode = RECORD.size, MESSAGE_HEAD.size, int(Opcode.MESSAGE)
    while at < size:
        if at + message_head <= size and data[at] == message_opcode:
            _, length, channel, _, log_time, publish_time = unpack_message(data, at)
            end = at + head + length
            if end > size or length < message_head - head:
                raise BadRecordError("message does not fit into its chunk")
            yield channel, log_time, publish_time, at + message_head, end
        else:
            if at + head > size:
                raise BadRecordError("chunk ends within a record")
            opcode, length = unpack_record(data, at)
            end = at + head + length
            if end > size:
                raise BadRecordError("record does not fit into its chunk")
            if opcode not in (Opcode.SCHEMA, Opcode.CHANNEL):
                raise BadRecordError(f"record with opcode {opcode:#04x} in a chunk")
            if define is not None:
                define(opcode, data[at + head : end])
        at = end
