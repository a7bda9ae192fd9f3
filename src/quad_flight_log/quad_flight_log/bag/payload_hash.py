"""One number for what a flight was: equal flights have equal payload hashes (decision record 0001)."""

import hashlib
from collections.abc import Iterable

import numpy as np

from quad_core.cascade import STAGES
from quad_flight_log.bag.reader import Flight
from quad_flight_log.errors import ConflictError, SchemaError, TopicError

STEP_TOPICS = (
    *("state", "truth", "actuation", "disturbance", "reference"),
    *(topic for stage in STAGES for topic in (stage.gives, stage.internals_topic)),
)


def topic_hashes(flight: Flight, topics: Iterable[str] = STEP_TOPICS) -> dict[str, str]:
    """Return {topic: SHA-256 over the CDR of each step in step order}; topics that the bag lacks are left out.

    Repeats are dropped after they were found equal, fields marked @wall or @run are masked with zeros. Raises
    TopicError if the bag lacks all of the topics, ConflictError if two messages of one step differ, SchemaError if a
    topic has no stamp.
    """
    present = [topic for topic in topics if flight.has(topic)]
    if not present:
        raise TopicError(f"{flight.path}: holds no topic of a flight: there is nothing to hash")
    arrays = flight.arrays(*present)
    payloads = flight.payloads(*present)
    found = {}
    for topic in present:
        name = flight.resolve(topic)
        where = f"{flight.path}: {name}"
        if "stamp_ns" not in (arrays[topic].dtype.names or ()):
            raise SchemaError(f"{where}: {flight.topics[name].type} has no stamp, so its steps cannot be told apart")
        kind = flight.type_of(name)
        rows = [kind.hashed(payload) for payload in payloads[name][0]]
        digest, last_stamp, last = hashlib.sha256(), None, b""
        for index in np.argsort(arrays[topic]["stamp_ns"], kind="stable").tolist():
            stamp = int(arrays[topic]["stamp_ns"][index])
            if stamp == last_stamp:
                if rows[index] != last:
                    raise ConflictError(f"{where}: two different messages for stamp {stamp} ns")
                continue
            last_stamp, last = stamp, rows[index]
            digest.update(last)
        found[topic] = digest.hexdigest()
    return found


def payload_hash(flight: Flight) -> str:
    """Return one SHA-256 (hex) over the names and hashes of all step topics in the bag; raises as ``topic_hashes``."""
    digest = hashlib.sha256()
    for topic, value in sorted(topic_hashes(flight).items()):
        digest.update(f"{topic} {value}\n".encode())
    return digest.hexdigest()
