"""The messages of a scanned MCAP file, chunk by chunk."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

from mcap.opcode import Opcode

from quad_flight_log.bag.mcap_records import RECORD, BadRecordError, unpacked_chunk, walk
from quad_flight_log.bag.mcap_scan import MAGIC, Scan
from quad_flight_log.errors import CorruptError


class RawMessage(NamedTuple):
    """One message as it stands in the file."""

    channel: int
    log_time: int
    publish_time: int
    data: bytes


def messages(
    found: Scan, channels: frozenset[int], progress: Callable[[int, int], None] | None = None
) -> Iterator[RawMessage]:
    """Yield the messages of ``channels`` in file order, from the verified prefix of ``found``.

    ``progress`` is called with (bytes gone over, bytes in all), last with both equal.
    Raises CorruptError if the file changed since it was scanned.
    """
    at = len(MAGIC)
    with found.path.open("rb") as stream:
        while at < found.end:
            stream.seek(at)
            head = stream.read(RECORD.size)
            if len(head) < RECORD.size:
                return
            opcode, length = RECORD.unpack(head)
            if opcode == Opcode.DATA_END:
                at = found.end
                break
            if progress:
                progress(at, found.end)
            if opcode == Opcode.MESSAGE or (
                opcode == Opcode.CHUNK and not channels.isdisjoint(found.chunk_channels[at])
            ):
                body = stream.read(length)
                try:
                    data = unpacked_chunk(body, found.own)[0] if opcode == Opcode.CHUNK else head + body
                    for channel, log_time, publish_time, start, end in walk(data, None):
                        if channel in channels:
                            yield RawMessage(channel, log_time, publish_time, data[start:end])
                except (BadRecordError, KeyError) as error:
                    raise CorruptError(f"{found.path}: changed while it was read ({error})") from error
            at += RECORD.size + length
    if progress:
        progress(found.end, found.end)
