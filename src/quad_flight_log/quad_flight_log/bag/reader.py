"""A recorded flight as NumPy arrays, read without ROS.

``open_flight`` verifies the whole file once; arrays are read from it when asked for. A topic may be named relative
(``truth``) or in full (``/truth``, ``/uav1/truth``).
"""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from mcap.well_known import MessageEncoding, SchemaEncoding

from quad_core.parameter_files import load_yaml
from quad_flight_log.bag import cdr, definitions
from quad_flight_log.bag.cdr import Table
from quad_flight_log.bag.mcap_messages import RawMessage, messages
from quad_flight_log.bag.mcap_scan import Scan, scan
from quad_flight_log.bag.metadata import PARAMETERS, QUAD, QUAD_END, checked_record
from quad_flight_log.bag.stamps import with_times
from quad_flight_log.errors import CorruptError, LimitError, NotAFlightError, SchemaError, TopicError

SHADOW = "shadow/"  # where controllers that are logged and not obeyed answer
BATCH = 16 << 20  # bytes of payload in one block
MEMORY_LIMIT = 4 << 30  # bytes of payload read at once unless the caller says otherwise


class Topic(NamedTuple):
    """One topic of a bag. ``name`` is full, ``size`` in payload bytes, ``first`` and ``last`` are log times in ns."""

    name: str
    type: str
    messages: int
    size: int
    first: int
    last: int
    type_hash: str
    offered_qos: str


class Flight:
    """A verified flight log.

    ``topics``: {full name: Topic}. ``metadata``: what the recorder noted (run id, seed, versions, drops, ...).
    ``parameters``: resolved parameters as in the attached YAML. ``truncated``: the file ends early and what is here is
    the verified prefix; ``damage`` says where. ``protected``: a checksum covers every message. ``unreadable``: {topic:
    why} of topics whose definition or encoding is none that can be decoded (their bytes still are in ``payloads``).
    """

    def __init__(
        self,
        found: Scan,
        namespace: str = "",
        memory_limit: int = MEMORY_LIMIT,
        progress: Callable[[int, int], None] | None = None,
        salvage: bool = False,
    ) -> None:
        self.path = found.path
        self.compressed_size, self.uncompressed_size = found.compressed_size, found.uncompressed_size
        self.written_by = found.written_by
        self.metadata = _metadata(found, salvage)
        self.truncated, self.damage, self.protected = found.truncated, found.damage, found.protected
        # without it /uav1/state and /uav1/flight/state both end like `state`
        vehicle = (namespace or self.metadata.get("namespace", "")).strip("/")
        self.namespace = f"/{vehicle}" if vehicle else ""
        self.parameters_text = _text(found, PARAMETERS)
        self._scan, self._limit, self._progress = found, memory_limit, progress
        self._channels: dict[str, list[int]] = {}
        self._schemas: dict[str, definitions.Schema] = {}
        self.unreadable: dict[str, str] = {}
        self._cache: dict[str, Table] = {}
        self.topics = self._topics()

    @property
    def parameters(self) -> Mapping[str, Any]:
        """The attached parameter file: {node: {"ros__parameters": {...}}}; empty if none is attached."""
        try:
            loaded = load_yaml(self.parameters_text) if self.parameters_text else {}
        except ValueError as error:
            raise CorruptError(f"{self.path}: attachment {PARAMETERS} is not YAML ({error})") from error
        if not isinstance(loaded, dict):
            raise CorruptError(f"{self.path}: attachment {PARAMETERS} holds {type(loaded).__name__}, expected a map")
        return loaded

    def record(self, name: str) -> dict[str, str]:
        """Return the last metadata record of that name, empty if there is none."""
        return next((dict(values) for found, values in reversed(self._scan.metadata) if found == name), {})

    def has(self, topic: str) -> bool:
        """Return whether the bag has at least one message of a topic."""
        try:
            return self.topics[self.resolve(topic)].messages > 0
        except TopicError:
            return False

    def resolve(self, topic: str) -> str:
        """Return the full name of a topic given in full or relative to the flight's namespace.

        Raises TopicError if there is none, or more than one and no namespace was given.
        """
        relative = topic.lstrip("/")
        for name in (topic, f"{self.namespace}/{relative}"):
            if name in self.topics:
                return name
        found = [name for name in self.topics if name.endswith("/" + relative)] if not topic.startswith("/") else []
        if not relative.startswith(SHADOW):
            found = [name for name in found if f"/{SHADOW}" not in name]
        if len(found) == 1 and not self.namespace:
            return found[0]
        if found and not self.namespace:
            raise TopicError(f"{self.path}: topic {topic!r} is one of {', '.join(found)}: name a namespace")
        have = ", ".join(self.topics) or "no topics"
        raise TopicError(f"{self.path}: no topic {topic!r}; the bag has {have}")

    def array(self, topic: str) -> Table:
        """Return all messages of a topic in the order of the bag, shape (n,).

        Fields: ``log_ns`` (time of recording), ``stamp_ns`` (message stamp; left out where the type has none), then the
        message's own. Raises TopicError, SchemaError, LimitError, CorruptError.
        """
        return self.arrays(topic)[topic]

    def arrays(self, *topics: str) -> dict[str, Table]:
        """Return {topic as given: array} of several topics, read in one pass."""
        names = {topic: self.resolve(topic) for topic in topics}
        missing = [name for name in dict.fromkeys(names.values()) if name not in self._cache]
        for name, (payloads, log_times) in self.payloads(*missing).items():
            where = f"{self.path}: {name}"
            table = cdr.table(self.schema(name), payloads, where)
            self._cache[name] = with_times(table, log_times, where)
        return {topic: self._cache[name] for topic, name in names.items()}

    def payloads(self, *topics: str) -> dict[str, tuple[list[bytes], list[int]]]:
        """Return {full name: (CDR payloads, log times in ns)} of topics, in the order of the bag."""
        names = [self.resolve(topic) for topic in topics]
        if not names:
            return {}
        size = sum(self.topics[name].size for name in names)
        if size > self._limit:
            raise LimitError(f"{self.path}: {', '.join(names)} hold {size} bytes, more than the {self._limit} allowed")
        found: dict[str, tuple[list[bytes], list[int]]] = {name: ([], []) for name in names}
        append: dict[int, tuple[Callable[[bytes], None], Callable[[int], None]]] = {}
        for name in names:
            for number in self._channels[name]:
                append[number] = (found[name][0].append, found[name][1].append)
        for channel, log_time, _, data in messages(self._scan, frozenset(append), self._progress):
            add_payload, add_time = append[channel]
            add_payload(data)
            add_time(log_time)
        return found

    def messages(self) -> Iterator[tuple[str, RawMessage]]:
        """Yield (full topic name, message as it stands in the file) of all topics in the order of the bag."""
        names = {number: name for name, numbers in self._channels.items() for number in numbers}
        for message in messages(self._scan, frozenset(names), self._progress):
            yield names[message.channel], message

    def definition_text(self, topic: str) -> str:
        """Return the definition of a topic's type as the text that the bag carries."""
        name = self.resolve(topic)
        channel = self._scan.channels[self._channels[name][0]]
        return str(self._scan.schemas[channel.schema_id].data.decode("utf-8", errors="replace"))

    def batches(self, *topics: str, limit: int = BATCH) -> Iterator[tuple[str, Table]]:
        """Yield (topic as given, array) in blocks of about ``limit`` payload bytes: memory stays bounded.

        Blocks of one topic come in the order of the bag. Sequences may be sub-arrays in one block and lists in another.
        """
        given = {self.resolve(topic): topic for topic in topics}
        owner = {number: name for name in given for number in self._channels[name]}
        waiting: dict[str, tuple[list[bytes], list[int]]] = {name: ([], []) for name in given}
        size = 0
        for channel, log_time, _, data in messages(self._scan, frozenset(owner), self._progress):
            payloads, times = waiting[owner[channel]]
            payloads.append(data)
            times.append(log_time)
            size += len(data)
            if size > limit:
                yield from self._tables(given, waiting)
                waiting, size = {name: ([], []) for name in given}, 0
        yield from self._tables(given, waiting)

    def _tables(
        self, given: Mapping[str, str], waiting: Mapping[str, tuple[list[bytes], list[int]]]
    ) -> Iterator[tuple[str, Table]]:
        for name, (payloads, times) in waiting.items():
            if payloads:
                where = f"{self.path}: {name}"
                yield given[name], with_times(cdr.table(self.schema(name), payloads, where), times, where)

    def schema(self, topic: str) -> definitions.Schema:
        """Return the parsed definition of a topic's type, as the bag carries it; SchemaError if it cannot be read."""
        name = self.resolve(topic)
        if name in self.unreadable:
            raise SchemaError(self.unreadable[name])
        return self._schemas[name]

    def _topics(self) -> dict[str, Topic]:
        found: dict[str, Topic] = {}
        texts: dict[str, tuple[str, bytes]] = {}
        parsed: dict[tuple[str, int], Any] = {}
        for number, channel in sorted(self._scan.channels.items(), key=lambda item: str(item[1].topic)):
            name, where = channel.topic, f"{self.path}: {channel.topic}"
            schema = self._scan.schemas.get(channel.schema_id)
            text = (schema.name, schema.data) if schema else ("", b"")
            if texts.setdefault(name, text) != text:
                raise SchemaError(f"{where}: two definitions of one topic, {texts[name][0]} and {text[0]}")
            if name not in self._schemas and name not in self.unreadable:
                key = (channel.message_encoding, channel.schema_id)
                if key not in parsed:  # many channels may share a definition that takes long to refuse
                    parsed[key] = _parsed(channel, schema)
                if isinstance(parsed[key], str):
                    self.unreadable[name] = f"{where}: {parsed[key]}"
                else:
                    self._schemas[name] = parsed[key]
            self._channels.setdefault(name, []).append(number)
            tally = self._scan.tallies.get(number)
            count, size, first, last = (tally.count, tally.size, tally.first, tally.last) if tally else (0, 0, 0, 0)
            if name in found and found[name].messages and count:
                before = found[name]
                count, size = count + before.messages, size + before.size
                first, last = min(first, before.first), max(last, before.last)
            elif name in found and not count:
                continue
            type_hash = channel.metadata.get("topic_type_hash", "")
            qos = channel.metadata.get("offered_qos_profiles", "")
            found[name] = Topic(name, text[0], count, size, first, last, type_hash, qos)
        return found


def _parsed(channel: Any, schema: Any) -> definitions.Schema | str:
    """Return the parsed definition of a channel, or why it cannot be read."""
    if channel.message_encoding != MessageEncoding.CDR or schema is None or schema.encoding != SchemaEncoding.ROS2:
        encoding = schema.encoding if schema else "no schema"
        return f"found {channel.message_encoding!r} with {encoding!r}, expected cdr with ros2msg"
    try:
        return definitions.parse(schema.name, schema.data.decode("utf-8", errors="replace"))
    except SchemaError as error:
        return str(error)


def open_flight(
    path: str | Path,
    *,
    namespace: str = "",
    salvage: bool = False,
    memory_limit: int = MEMORY_LIMIT,
    progress: Callable[[int, int], None] | None = None,
) -> Flight:
    """Open a bag directory or an MCAP file and verify it.

    A file that was not closed is read as its verified prefix (``truncated``). ``salvage`` accepts the prefix before any
    other damage too. ``progress`` is called with (bytes read, bytes in all) in every pass over the file.
    Raises NotAFlightError, CorruptError, LimitError or SchemaError, all FlightLogError.
    """
    return Flight(
        scan(find_mcap(Path(path)), salvage=salvage, progress=progress), namespace, memory_limit, progress, salvage
    )


def find_mcap(path: Path) -> Path:
    """Return the MCAP file of a bag directory (or ``path`` itself if it is a file)."""
    if path.is_file():
        return path
    if not path.is_dir():
        raise NotAFlightError(f"{path}: no such file or directory")
    files = sorted([*path.glob("*.mcap"), *path.glob("*.mcap.part")])
    if len(files) == 1:
        return files[0]
    if not files:
        raise NotAFlightError(f"{path}: no *.mcap in it, expected a bag directory")
    names = ", ".join(file.name for file in files)
    raise NotAFlightError(f"{path}: holds {names}; expected one MCAP file, name the one to read")


def _metadata(found: Scan, salvage: bool) -> dict[str, str]:
    merged: dict[str, str] = {}
    for name, values in found.metadata:
        if name in (QUAD, QUAD_END):
            try:
                merged.update(checked_record(values, strict=found.own))
            except ValueError as error:
                problem = f"metadata record {name!r}: {error}"
                if not salvage:
                    raise CorruptError(f"{found.path}: {problem}") from error
                found.truncated, found.damage = True, "; ".join(filter(None, [found.damage, problem]))
    return merged


def _text(found: Scan, name: str) -> str:
    try:
        return found.attachments.get(name, b"").decode("utf-8")
    except UnicodeDecodeError as error:
        raise CorruptError(f"{found.path}: attachment {name} is not UTF-8") from error
