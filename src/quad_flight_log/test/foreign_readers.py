"""One flight through readers that share no code with ours: each gives {topic: (count, digest over all values)}."""

import hashlib
import json
import os
import shutil
import struct
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import flight_samples
import numpy as np

from quad_flight_log.bag.reader import open_flight

Digests = dict[str, tuple[int, str]]
JAVASCRIPT = Path(__file__).parent / "javascript"


class MissingToolError(Exception):
    """Node.js or its packages are not to be had here."""


def leaves(value: Any) -> Iterator[bytes]:
    """Yield every number (as float64) and text of a message in the order of its definition, lists by their length."""
    if isinstance(value, str):
        yield struct.pack("<d", len(value.encode())) + value.encode()
    elif isinstance(value, np.void):
        for name in value.dtype.names:
            yield from leaves(value[name])
    elif hasattr(value, "__msgtype__"):
        for name, _ in flight_samples.typestore().fielddefs[value.__msgtype__][1]:
            yield from leaves(getattr(value, name))
    elif isinstance(value, dict):
        for item in value.values():
            yield from leaves(item)
    elif isinstance(value, list | tuple | np.ndarray):
        yield struct.pack("<d", len(value))
        for item in value:
            yield from leaves(item)
    elif hasattr(value, "__slots__") and not isinstance(value, int | float | np.generic):
        for name in value.__slots__:
            yield from leaves(getattr(value, name))
    else:
        yield struct.pack("<d", float(value))


def digests(messages: Iterable[tuple[str, Any]]) -> Digests:
    """Return count and digest of each topic of (topic, message) pairs."""
    found: dict[str, Any] = {}
    for topic, message in messages:
        entry = found.setdefault(topic, [0, hashlib.sha256()])
        entry[0] += 1
        for part in leaves(message):
            entry[1].update(part)
    return {topic: (count, digest.hexdigest()) for topic, (count, digest) in found.items()}


def ours(bag: Path) -> Digests:
    """Read a bag directory with quad_flight_log."""
    flight = open_flight(bag)

    def rows() -> Iterator[tuple[str, Any]]:
        for name in flight.topics:
            table = flight.array(name)
            for row in table[list(flight.type_of(name).fields)]:
                yield name, row

    return digests(rows())


def by_rosbags(bag: Path) -> Digests:
    """Read a bag directory with rosbags."""
    from rosbags.rosbag2 import Reader

    store = flight_samples.typestore()
    with Reader(bag) as reader:
        return digests(
            (connection.topic, store.deserialize_cdr(raw, connection.msgtype))
            for connection, _, raw in reader.messages()
        )


def by_mcap_ros2(bag: Path) -> Digests:
    """Read a bag directory with mcap and mcap-ros2-support."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    (path,) = bag.glob("*.mcap")
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return digests((item.channel.topic, item.decoded_message) for item in reader.iter_decoded_messages())


def by_javascript(bag: Path) -> Digests:
    """Read a bag directory with @mcap/core and @foxglove/rosmsg2-serialization; raises MissingToolError."""
    home = _packages()
    (path,) = bag.glob("*.mcap")
    command = ["node", str(home / "read_bag.mjs"), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return {topic: (count, digest) for topic, (count, digest) in json.loads(done.stdout).items()}


def _packages() -> Path:
    """Return a directory outside the repository with the script and its packages, installed once."""
    if not (shutil.which("node") and shutil.which("npm")):
        raise MissingToolError("node and npm are not installed")
    manifest = (JAVASCRIPT / "package.json").read_bytes()
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    home = cache / "quad_flight_log" / f"javascript-{hashlib.sha256(manifest).hexdigest()[:12]}"
    home.mkdir(parents=True, exist_ok=True)
    if not (home / "node_modules" / "fzstd" / "package.json").is_file():
        (home / "package.json").write_bytes(manifest)
        command = ["npm", "install", "--no-audit", "--no-fund", "--ignore-scripts", "--no-package-lock"]
        done = subprocess.run(command, cwd=home, capture_output=True, text=True, timeout=120, check=False)
        if done.returncode != 0:
            raise MissingToolError(f"npm cannot install the packages: {done.stderr.strip().splitlines()[-1:]}")
    shutil.copy(JAVASCRIPT / "read_bag.mjs", home)
    return home
