"""The files of a bag: which they are, in which order, and how each is read.

A bag is a directory as rosbag2 leaves it (one file or several, MCAP or SQLite, plain or compressed with zstd), or one
of its files.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import Reader

from quad_core.parameter_files import load_yaml
from quad_flight_log.bag.mcap_file import Channel, McapFile, Message, Progress
from quad_flight_log.bag.notes import METADATA_FILE
from quad_flight_log.errors import CorruptError, NotAFlightError

_PACKED = {".zstd": "zstd", ".zst": "zstd", ".lz4": "lz4", ".gz": "gzip", ".bz2": "bzip2", ".xz": "xz"}
_NUMBERED = re.compile(r"(.*)_(\d+)$")


class BagFile(Protocol):
    """What is read from a file of a bag, as in ``McapFile``."""

    path: Path
    written_by: str
    damage: str
    truncated: bool
    protected: bool
    uncompressed_size: int
    channels: dict[int, Channel]
    notes: list[tuple[str, dict[str, str]]]
    attachments: dict[str, bytes]

    def messages(self, *, salvage: bool = False, progress: Progress | None = None) -> Iterator[Message]:
        """Yield the messages in the order of the file."""


class Files(NamedTuple):
    """The files of a bag in order, their names, and the names that ``metadata.yaml`` lists and that are not there."""

    files: list[BagFile]
    names: list[str]
    missing: list[str]


class SqliteFile:
    """An SQLite bag, read by ``rosbags``: a whole directory, or one file. The format has no checksums."""

    def __init__(self, path: Path, source: Path) -> None:
        """Read ``source`` later; ``path`` names the first file."""
        self.path, self._source = path, source
        self.written_by, self.damage, self.truncated, self.protected = "rosbag2 (SQLite)", "", False, False
        self.uncompressed_size = 0
        self.channels: dict[int, Channel] = {}
        self.notes: list[tuple[str, dict[str, str]]] = []
        self.attachments: dict[str, bytes] = {}

    def messages(self, *, salvage: bool = False, progress: Progress | None = None) -> Iterator[Message]:  # noqa: ARG002
        """Yield the messages in the order of their times; as in ``McapFile``."""
        try:
            with Reader(self._source) as reader:
                of = {connection.id: _channel(connection) for connection in reader.connections}
                self.channels = of
                for connection, time, data in reader.messages():
                    yield Message(of[connection.id], time, time, bytes(data))
        except Exception as error:  # whatever rosbags, SQLite and zstd raise
            problem = " ".join(str(error).split())[:200] or type(error).__name__
            self.truncated, self.damage = True, problem
            if not salvage:
                raise CorruptError(f"{self._source}: {problem}") from error


def _channel(connection: Any) -> Channel:
    encodings = {MessageDefinitionFormat.MSG: "ros2msg", MessageDefinitionFormat.IDL: "ros2idl"}
    encoding, text = encodings.get(connection.msgdef.format, ""), connection.msgdef.data.encode()
    return Channel(connection.topic, connection.msgtype, "cdr", encoding, text, connection.digest or "", "")


def files_of(path: Path) -> Files:
    """Return the files of a bag; raises NotAFlightError where no file is there or readable."""
    if path.is_file():
        return Files([_file(path)], [path.name], [])
    if not path.is_dir():
        raise NotAFlightError(f"{path}: no such file or directory")
    found = [each for each in path.iterdir() if {".mcap", ".db3"} & set(each.suffixes) and each.is_file()]
    if not found:
        raise NotAFlightError(f"{path}: no *.mcap and no *.db3 in it, expected a bag directory")
    listed = _listed(path)
    here = {each.name: each for each in sorted(found, key=_place)}
    known = [name for name in listed if name in here]
    names = known or list(here)
    places = [_place(here[name]) for name in names]
    if not known and (len({stem for stem, _ in places}) > 1 or len(set(places)) < len(places)):
        raise NotAFlightError(f"{path}: holds {', '.join(names)}; expected one bag, name the file to read")
    missing = [name for name in listed if name not in here] if known else []
    first = here[names[0]]
    if ".db3" in first.suffixes:
        return Files([SqliteFile(first, path if listed else first)], names, missing)
    return Files([_file(here[name]) for name in names], names, missing)


def _file(path: Path) -> BagFile:
    packed = _PACKED.get(path.suffix, "")
    if packed not in ("", "zstd"):
        raise NotAFlightError(f"{path}: compressed with {packed}, expected zstd or none: unpack the file first")
    if ".db3" in path.suffixes:
        if packed:
            raise NotAFlightError(
                f"{path}: a compressed SQLite file is read with its metadata.yaml: name the directory"
            )
        return SqliteFile(path, path)
    return McapFile(path)


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
        raise NotAFlightError(
            f"{directory}: compressed with {kind!r} ({mode}), expected zstd or none: convert it with `ros2 bag convert`"
        )
    return names
