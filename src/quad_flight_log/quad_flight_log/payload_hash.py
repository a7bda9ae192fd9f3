"""One number for what a flight was: equal flights have equal payload hashes (decision record 0001)."""

import hashlib
from collections.abc import Iterable
from operator import itemgetter

from quad_core.cascade import STAGES
from quad_flight_log.errors import CorruptError, SchemaError
from quad_flight_log.reader import Flight

STEP_TOPICS = (
    *("state", "truth", "actuation", "disturbance", "reference"),
    *(topic for stage in STAGES for topic in (stage.output, stage.internals_topic)),
)


_HEAD, _RUN = ("stamp", "step", "run"), slice(20, 24)
"""How messages of a flight begin, and where in their payload the number of the run is: equal flights differ in it."""


def step_rows(flight: Flight, topics: Iterable[str]) -> dict[str, list[tuple[int, bytes]]]:
    """Return {topic: (stamp in ns, CDR) of each message in step order}; topics that the bag lacks are left out.

    The number of the run is left out. Raises SchemaError if a topic has no stamp.
    """
    found = {}
    for topic in filter(flight.has, topics):
        name, kind, table = flight.resolve(topic), flight.type_of(topic), flight.array(topic)
        if "stamp_ns" not in (table.dtype.names or ()):
            raise SchemaError(f"{flight.path}: {name}: {kind.name} has no stamp, so its steps cannot be told apart")
        payloads = flight.payloads(name)[name][0]
        if kind.fields[: len(_HEAD)] == _HEAD:
            payloads = [each[: _RUN.start] + bytes(4) + each[_RUN.stop :] for each in payloads]
        found[topic] = sorted(zip(table["stamp_ns"].tolist(), payloads, strict=True), key=itemgetter(0))
    return found


def topic_hashes(flight: Flight, topics: Iterable[str] = STEP_TOPICS) -> dict[str, str]:
    """Return {topic: SHA-256 over the rows of ``step_rows``}.

    Repeats are dropped after they were found equal. Raises TopicError if the bag lacks all of the topics, CorruptError
    if two messages of one step differ, SchemaError as ``step_rows``.
    """
    found = {}
    for topic, rows in step_rows(flight, topics).items():
        by_step = dict(rows)
        different = next((stamp for stamp, row in rows if by_step[stamp] != row), None)
        if different is not None:
            where = f"{flight.path}: {flight.resolve(topic)}"
            raise CorruptError(f"{where}: two different messages for stamp {different} ns")
        found[topic] = hashlib.sha256(b"".join(by_step.values())).hexdigest()
    if not found:
        raise flight.without_topics("there is nothing to hash")
    return found


def payload_hash(flight: Flight) -> str:
    """Return one SHA-256 (hex) over the names and hashes of all step topics in the bag; raises as ``topic_hashes``."""
    digest = hashlib.sha256()
    for topic, value in sorted(topic_hashes(flight).items()):
        digest.update(f"{topic} {value}\n".encode())
    return digest.hexdigest()
