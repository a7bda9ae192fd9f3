"""Bags as other recorders leave them: split, compressed, SQLite, merged, with encodings and records unlike ours."""

import struct
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import flight_samples
import yaml
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
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


def sent(topic: str, message: Any) -> Sent:
    """Return a rosbags message as a recorder receives it."""
    kind = message.__msgtype__
    text = flight_samples.definition(kind).text.encode()
    return Sent(f"/{topic.lstrip('/')}", kind, text, flight_samples.encoded(message))


def poses(indexes: Iterable[int] = range(20), topic: str = "/pose") -> list[Sent]:
    """Return poses, number ``index`` as many decimetres along x."""
    found = []
    for index in indexes:
        header = {"stamp": flight_samples.time_of(START + index * PERIOD), "frame_id": "map"}
        inside = {"position": {"x": 0.1 * index, "z": 1.0}, "orientation": {"w": 1.0}}
        found.append(sent(topic, flight_samples.message(KIND, header=header, pose=inside)))
    return found


def started(stream: Any, **options: Any) -> Writer:
    """Return a writer to ``stream`` that has begun."""
    writer = Writer(stream, **options)
    writer.start("ros2", "another recorder")
    return writer


def in_one_file(
    path: Path, messages: list[Sent], times: Mapping[int, int] = MappingProxyType({}), **options: Any
) -> Path:
    """Write an MCAP file with the wall clock as log time and no notes; ``times``: {number of a message: its time}."""
    with path.open("wb") as stream:
        writer, channels = started(stream, **options), {}
        for index, one in enumerate(messages):
            if (one.topic, one.text) not in channels:
                schema = writer.register_schema(one.kind, "ros2msg", one.text)
                channels[one.topic, one.text] = writer.register_channel(one.topic, "cdr", schema)
            time = times.get(index, START + index * 1000)
            writer.add_message(channels[one.topic, one.text], time, one.data, time, index)
        writer.finish()
    return path


def rosbag(
    directory: Path,
    messages: list[Sent],
    storage: StoragePlugin = StoragePlugin.MCAP,
    mode: CompressionMode = CompressionMode.NONE,
) -> Path:
    """Write a bag with rosbags, as ``ros2 bag record`` would: any topics, no records of ours."""
    writer, connections = RosbagsWriter(directory, version=9, storage_plugin=storage), {}
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        for index, one in enumerate(messages):
            if one.topic not in connections:
                known = flight_samples.typestore()
                connections[one.topic] = writer.add_connection(one.topic, one.kind, typestore=known)
            writer.write(connections[one.topic], START + index * 1000, one.data)
    return directory


def sqlite(directory: Path, messages: list[Sent], mode: CompressionMode = CompressionMode.NONE) -> Path:
    """Write an SQLite bag."""
    return rosbag(directory, messages, StoragePlugin.SQLITE3, mode)


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


def split(directory: Path, messages: list[Sent], parts: int = 2, *, metadata: bool = True) -> Path:
    """Write a bag of ``parts`` files, numbered without leading zeros."""
    names = [f"{directory.name}_{part}.mcap" for part in range(parts)]
    directory.mkdir(parents=True)
    for part, name in enumerate(names):
        in_one_file(directory / name, messages[part * len(messages) // parts : (part + 1) * len(messages) // parts])
    return listed(directory, names) if metadata else directory


def split_sqlite(directory: Path, messages: list[Sent]) -> Path:
    """Write an SQLite bag of two files."""
    half = len(messages) // 2
    for number, part in enumerate((messages[:half], messages[half:])):
        (path,) = sqlite(directory / f"part{number}", part).glob("*.db3")
        path.rename(directory / f"{directory.name}_{number}.db3")
    return listed(directory, [f"{directory.name}_{number}.db3" for number in range(2)], storage="sqlite3")


def encodings(path: Path) -> Path:
    """Write a good topic among five that hold no CDR or no definition of it, and one whose payloads do not fit."""
    (good, *_) = poses()
    with path.open("wb") as stream:
        writer = started(stream)
        for topic, encoding, kind, schema_encoding, text, data in (
            ("/pose", "cdr", good.kind, "ros2msg", good.text, good.data),
            ("/json", "json", "Thing", "jsonschema", b"{}", b""),
            ("/protobuf", "protobuf", "a.Thing", "protobuf", b"\n\x01x", b""),
            ("/idl", "cdr", "a/msg/Thing", "ros2idl", b"module a { struct Thing { double x; }; };", b""),
            ("/incomplete", "cdr", "a/msg/Thing", "ros2msg", b"a/Inner inner\n", b""),
            ("/short", "cdr", "a/msg/Short", "ros2msg", b"float64[4] x\n", b""),
        ):
            schema = writer.register_schema(kind, schema_encoding, text)
            channel = writer.register_channel(topic, encoding, schema)
            writer.add_message(channel, START, data or b"\0\1\0\0" + struct.pack("<d", 1.0), START)
        channel = writer.register_channel("/undefined", "cdr", 0)
        writer.add_message(channel, START, b"\0\1\0\0\1\0\0\0", START)
        writer.finish()
    return path


def named(path: Path, topics: Iterable[str]) -> Path:
    """Write five poses to each topic."""
    messages = [pose for topic in topics for pose in poses(range(5), topic)]
    return in_one_file(path, messages, compression=CompressionType.LZ4)


def received(bag: Path) -> list[Sent]:
    """Return the messages of our bag in the order in which a recorder received them."""
    with next(bag.glob("*.mcap")).open("rb") as stream:
        found = make_reader(stream).iter_messages(log_time_order=False)
        return [Sent(channel.topic, schema.name, schema.data, message.data) for schema, channel, message in found]


def recorded_again(bag: Path, path: Path, change: Callable[[list[Sent]], list[Sent]] = lambda sent: sent) -> Path:
    """Write our bag as a recorder of others would; ``change`` what it received."""
    return in_one_file(path, change(received(bag)))


VERDICT = ("truth", "reference", "actuation", "flight/state", "flight/guard", "flight/parameters", "flight/mode")


def in_few_topics(path: Path, messages: list[Sent]) -> Path:
    """Write the topics that a verdict needs, and no other, as one MCAP file."""
    return in_one_file(path, [one for one in messages if one.topic.lstrip("/") in VERDICT])


FORMS = {"as ros2 bag record": in_one_file, "split": split, "SQLite": sqlite, "some topics": in_few_topics}
"""{form: function that writes what a recorder received to a path}."""
