"""Bags as other recorders leave them: split, compressed, SQLite, merged, with encodings and records unlike ours."""

import io
import sqlite3
import struct
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import flight_samples
import yaml
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter


class Sent(NamedTuple):
    """A message as a recorder receives it: topic, type, its definition and payload."""

    topic: str
    kind: str
    text: bytes
    data: bytes


START = 1_700_000_000_000_000_000  # ns
PERIOD = 10_000_000  # ns
KIND = "geometry_msgs/msg/PoseStamped"


def pose(index: int) -> bytes:
    """Return the payload of a pose ``index`` decimetres along x."""
    header = {"stamp": flight_samples.time_of(START + index * PERIOD), "frame_id": "map"}
    inside = {"position": {"x": 0.1 * index, "z": 1.0}, "orientation": {"w": 1.0}}
    return flight_samples.encoded(flight_samples.message(KIND, header=header, pose=inside))


def put(writer: Writer, topic: str, indexes: Iterable[int], *, text: str = "", packed: bool = False) -> None:
    """Write poses to ``topic``; ``text``: another definition, ``packed``: compressed message by message."""
    schema = writer.register_schema(KIND, "ros2msg", (text or flight_samples.definition(KIND).text).encode())
    channel = writer.register_channel(topic, "cdr", schema)
    for index in indexes:
        data = zstandard.compress(pose(index)) if packed else pose(index)
        writer.add_message(channel, START + index * PERIOD, data, START + index * PERIOD, index)


def started(stream: Any, **options: Any) -> Writer:
    """Return a writer to ``stream`` that has begun."""
    writer = Writer(stream, **options)
    writer.start("ros2", "another recorder")
    return writer


def mcap(path: Path, indexes: Iterable[int] = range(20), topic: str = "/pose", **options: Any) -> Path:
    """Write one MCAP file with poses."""
    packed = options.pop("packed", False)
    with path.open("wb") as stream:
        writer = started(stream, **options)
        put(writer, topic, indexes, packed=packed)
        writer.finish()
    return path


def listed(directory: Path, names: list[str], *, mode: str = "", form: str = "", storage: str = "mcap") -> Path:
    """Write the metadata.yaml of a bag with these files; returns the directory."""
    topic = {"name": "/pose", "type": KIND, "serialization_format": "cdr", "offered_qos_profiles": ""}
    about = {
        "version": 5, "storage_identifier": storage, "duration": {"nanoseconds": 19 * PERIOD},
        "starting_time": {"nanoseconds_since_epoch": START}, "message_count": 20,
        "topics_with_message_count": [{"topic_metadata": topic, "message_count": 20}],
        "compression_format": form, "compression_mode": mode, "relative_file_paths": names,
    }  # fmt: skip
    (directory / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": about}))
    return directory


def made(directory: Path) -> Path:
    """Create ``directory`` and return it."""
    directory.mkdir(parents=True)
    return directory


def split(directory: Path, parts: int = 2, *, metadata: bool = True) -> Path:
    """Write a bag of ``parts`` files, numbered without leading zeros."""
    names = [f"{directory.name}_{part}.mcap" for part in range(parts)]
    made(directory)
    for part, name in enumerate(names):
        mcap(directory / name, range(part * 20 // parts, (part + 1) * 20 // parts))
    return listed(directory, names) if metadata else directory


def packed_file(directory: Path) -> Path:
    """Write a bag whose file is compressed as a whole."""
    made(directory)
    stream = io.BytesIO()
    writer = started(stream)
    put(writer, "/pose", range(20))
    writer.finish()
    name = f"{directory.name}_0.mcap.zstd"
    (directory / name).write_bytes(zstandard.compress(stream.getvalue()))
    return listed(directory, [name], mode="FILE", form="zstd")


def packed_messages(directory: Path) -> Path:
    """Write a bag whose messages are compressed one by one."""
    made(directory)
    name = f"{directory.name}_0.mcap"
    mcap(directory / name, packed=True)
    return listed(directory, [name], mode="MESSAGE", form="zstd")


def sqlite(directory: Path, parts: int = 1, *, packed: bool = False) -> Path:
    """Write an SQLite bag of ``parts`` files; ``packed``: each compressed as a whole."""
    made(directory)
    names = []
    for part in range(parts):
        path = directory / f"{directory.name}_{part}.db3"
        base = sqlite3.connect(path)
        base.execute("create table topics(id integer primary key, name text, type text, serialization_format text, "
                     "offered_qos_profiles text)")  # fmt: skip
        base.execute("create table messages(id integer primary key, topic_id integer, timestamp integer, data blob)")
        base.execute("insert into topics values(1, '/pose', ?, 'cdr', '')", (KIND,))
        for index in range(part * 20 // parts, (part + 1) * 20 // parts):
            base.execute("insert into messages(topic_id, timestamp, data) values(1, ?, ?)",
                         (START + index * PERIOD, pose(index)))  # fmt: skip
        base.commit()
        base.close()
        if packed:
            path.with_name(path.name + ".zstd").write_bytes(zstandard.compress(path.read_bytes()))
            path.unlink()
        names.append(path.name + ".zstd" * packed)
    return listed(directory, names, storage="sqlite3", mode="FILE" * packed, form="zstd" * packed)


def merged(path: Path, other: str) -> Path:
    """Write one topic with two definitions: ours, and ``other``."""
    with path.open("wb") as stream:
        writer = started(stream)
        put(writer, "/pose", range(10))
        put(writer, "/pose", range(10, 20), text=other)
        writer.finish()
    return path


def encodings(path: Path) -> Path:
    """Write a good topic among five that hold no CDR or no definition of it, and one whose payloads do not fit."""
    with path.open("wb") as stream:
        writer = started(stream)
        put(writer, "/pose", range(20))
        for topic, encoding, kind, schema_encoding, text in (
            ("/json", "json", "Thing", "jsonschema", b"{}"),
            ("/protobuf", "protobuf", "a.Thing", "protobuf", b"\n\x01x"),
            ("/idl", "cdr", "a/msg/Thing", "ros2idl", b"module a { struct Thing { double x; }; };"),
            ("/incomplete", "cdr", "a/msg/Thing", "ros2msg", b"a/Inner inner\n"),
            ("/short", "cdr", "a/msg/Short", "ros2msg", b"float64[4] x\n"),
        ):
            schema = writer.register_schema(kind, schema_encoding, text)
            channel = writer.register_channel(topic, encoding, schema)
            writer.add_message(channel, START, b"\0\1\0\0" + struct.pack("<d", 1.0), START)
        channel = writer.register_channel("/undefined", "cdr", 0)
        writer.add_message(channel, START, b"\0\1\0\0\1\0\0\0", START)
        writer.finish()
    return path


def named(path: Path, topics: Iterable[str]) -> Path:
    """Write five poses to each topic."""
    with path.open("wb") as stream:
        writer = started(stream, compression=CompressionType.LZ4)
        for topic in topics:
            put(writer, topic, range(5))
        writer.finish()
    return path


def received(bag: Path) -> list[Sent]:
    """Return the messages of our bag in the order in which a recorder received them."""
    with next(bag.glob("*.mcap")).open("rb") as stream:
        found = make_reader(stream).iter_messages(log_time_order=False)
        return [Sent(channel.topic, schema.name, schema.data, message.data) for schema, channel, message in found]


def recorded_again(bag: Path, path: Path, change: Callable[[list[Sent]], list[Sent]] = lambda sent: sent) -> Path:
    """Write our bag as a recorder of others would: wall clock as log time, no notes; ``change`` what it received."""
    return in_one_file(path, change(received(bag)))


def in_one_file(path: Path, sent: list[Sent], times: Mapping[int, int] = MappingProxyType({})) -> Path:
    """Write what a recorder of others received as one MCAP file; ``times``: {number of a message: its log time}."""
    with path.open("wb") as stream:
        writer, channels = started(stream), {}
        for index, one in enumerate(sent):
            if one.topic not in channels:
                schema = writer.register_schema(one.kind, "ros2msg", one.text)
                channels[one.topic] = writer.register_channel(one.topic, "cdr", schema)
            time = times.get(index, START + index * 1000)
            writer.add_message(channels[one.topic], time, one.data, time, index)
        writer.finish()
    return path


def in_two_files(directory: Path, sent: list[Sent]) -> Path:
    """Write what a recorder of others received as a split bag."""
    names = [f"{directory.name}_{part}.mcap" for part in range(2)]
    made(directory)
    for name, part in zip(names, (sent[: len(sent) // 2], sent[len(sent) // 2 :]), strict=True):
        in_one_file(directory / name, part)
    return listed(directory, names)


def in_sqlite(directory: Path, sent: list[Sent]) -> Path:
    """Write what a recorder of others received as an SQLite bag."""
    with RosbagsWriter(directory, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {}
        for index, one in enumerate(sent):
            if one.topic not in connections:
                known = flight_samples.typestore()
                connections[one.topic] = writer.add_connection(one.topic, one.kind, typestore=known)
            writer.write(connections[one.topic], START + index * 1000, one.data)
    return directory


VERDICT = ("truth", "reference", "actuation", "flight/state", "flight/guard", "flight/parameters", "flight/mode")


def in_few_topics(path: Path, sent: list[Sent]) -> Path:
    """Write the topics that a verdict needs, and no other, as one MCAP file."""
    return in_one_file(path, [one for one in sent if one.topic.lstrip("/") in VERDICT])


FORMS = {
    "as ros2 bag record": in_one_file,
    "split": in_two_files,
    "SQLite": in_sqlite,
    "some topics": in_few_topics,
}
"""{form: function that writes what a recorder received to a path}."""
