"""The recorder's memory does not grow with the flight, and the file is the same as without that care."""

import io
import tracemalloc

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from quad_flight_log.bag.flat_writer import CHUNK_SIZE, chunk_indexes, flat_writer


def chunks(writer: Writer, first: int, count: int) -> None:
    rng = np.random.default_rng(first)
    for number in range(first, first + count):
        for channel in writer.channels:
            # not in the order of time
            writer.add_message(channel, 32 * number + (channel ^ 5), rng.bytes(40), number + 1)
        writer.flush()


def started(writer: Writer) -> Writer:
    writer.start("ros2", "test")
    schema = writer.register_schema("a/msg/A", "ros2msg", b"float64 x")
    writer.channels = [writer.register_channel(f"/t{index}", "cdr", schema) for index in range(20)]
    return writer


def test_memory_stays_flat_however_many_chunks_are_written(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = started(flat_writer(stream, path))
        chunks(writer, 0, 50)
        tracemalloc.start()
        chunks(writer, 50, 50)
        before, _ = tracemalloc.get_traced_memory()
        chunks(writer, 100, 2000)
        after, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert after - before < 20_000  # 2000 chunks cost mcap's own writer 4 MB


def test_the_file_is_byte_for_byte_that_of_the_library(tmp_path):
    path = tmp_path / "a.mcap"
    plain = io.BytesIO()
    theirs = started(Writer(plain, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD, enable_data_crcs=True))
    with path.open("wb") as stream:
        ours = started(flat_writer(stream, path))
        for writer in (theirs, ours):
            writer.add_metadata("before", {"a": "b"})
            chunks(writer, 0, 7)
            writer.add_attachment(0, 0, "file", "text/plain", b"content")
            chunks(writer, 7, 3)
            writer.add_metadata("after", {"a": "b"})
            writer.finish()
    assert path.read_bytes() == plain.getvalue()
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert list(chunk_indexes(path)) == summary.chunk_indexes
    assert len(summary.chunk_indexes) == 10
