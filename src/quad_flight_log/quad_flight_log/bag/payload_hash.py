"""One number for what a flight was: equal flights have equal payload hashes (decision record 0001)."""

import hashlib
from collections.abc import Iterable
from operator import itemgetter

from quad_core.cascade import STAGES
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import CorruptError, SchemaError

STEP_TOPICS = (
    *("state", "truth", "actuation", "disturbance", "reference"),
    *(topic for stage in STAGES for topic in (stage.output, stage.internals_topic)),
)


def step_rows(flight: Flight, topics: Iterable[str]) -> dict[str, list[tuple[int, bytes]]]:
    """Return {topic: (stamp in ns, CDR) of each message in step order}; topics that the bag lacks are left out.

    Fields marked @wall or @run are masked with zeros. Raises SchemaError if a topic has no stamp.
    """
    found = {}
    for topic in filter(flight.has, topics):
        name, kind, table = flight.resolve(topic), flight.type_of(topic), flight.array(topic)
        if "stamp_ns" not in (table.dtype.names or ()):
            raise SchemaError(f"{flight.path}: {name}: {kind.name} has no stamp, so its steps cannot be told apart")
        rows = zip(table["stamp_ns"].tolist(), map(kind.hashed, flight.payloads(name)[name][0]), strict=True)
        found[topic] = sorted(rows, key=itemgetter(0))
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
