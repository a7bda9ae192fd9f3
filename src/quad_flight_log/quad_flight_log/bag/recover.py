"""A readable bag from whatever is left of one: killed recorder, full disk, cut copy, damage further on."""

import time
from pathlib import Path
from typing import NamedTuple

from quad_flight_log.bag.definitions import Definition
from quad_flight_log.bag.mcap_records import CHUNK_LIMIT
from quad_flight_log.bag.metadata import qos_of
from quad_flight_log.bag.reader import Flight
from quad_flight_log.bag.writer import BACKLOG_LIMIT, BagReport, BagWriter
from quad_flight_log.errors import BagWriteError

_WRITER_NOTES = ("messages", "dropped")  # counted anew


class Recovered(NamedTuple):
    """What came of it: the new bag, and topics whose encoding the writer does not know."""

    report: BagReport
    left_out: list[str]


def recover(flight: Flight, directory: Path) -> Recovered:
    """Write the verified prefix of ``flight`` (opened with ``salvage``) as a new bag into ``directory``.

    Metadata, parameters, times, definitions and QoS are kept. Raises BagWriteError if ``directory`` holds something
    or the new bag could not be finished.
    """
    definitions = {
        topic.type: Definition(topic.type, flight.definition_text(name), topic.type_hash)
        for name, topic in flight.topics.items()
        if name not in flight.unreadable
    }
    start = {key: value for key, value in flight.metadata.items() if key not in _WRITER_NOTES}
    bag = BagWriter(
        directory,
        metadata=start,
        parameters=flight.parameters_text,
        definition_of=definitions.__getitem__,
        message_limit=CHUNK_LIMIT // 2,
    )
    handles = {
        name: bag.add_topic(name, topic.type, qos_of(topic.offered_qos))
        for name, topic in flight.topics.items()
        if name not in flight.unreadable
    }
    for name, message in flight.messages():
        while bag.backlog > BACKLOG_LIMIT // 2 and not bag.error:
            time.sleep(0.01)
        if name in handles:
            bag.write(handles[name], message.data, message.log_time, message.publish_time)
    outcome = flight.metadata.get("outcome", "unknown")
    report = bag.close({"outcome": outcome, "recovered_from": flight.path.name, "damage": flight.damage or "none"})
    if report.error or report.dropped:
        raise BagWriteError(report.error or f"{directory}: {report.dropped} messages could not be written")
    return Recovered(report, sorted(flight.unreadable))
