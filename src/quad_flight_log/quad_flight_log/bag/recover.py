"""A readable bag from whatever is left of one: killed recorder, full disk, cut copy, damage further on."""

import time
from pathlib import Path
from typing import NamedTuple

from quad_flight_log.bag.notes import qos_of
from quad_flight_log.bag.reader import Flight
from quad_flight_log.bag.writer import BACKLOG_LIMIT, BagReport, BagWriter, Definition
from quad_flight_log.errors import BagWriteError

_WRITER_NOTES = ("messages", "dropped")  # counted anew
_MESSAGE_LIMIT = 64 << 20  # bytes; other recorders have no limit


class Recovered(NamedTuple):
    """What came of it: the new bag, and topics whose encoding the writer does not know."""

    report: BagReport
    left_out: list[str]


def recover(flight: Flight, directory: Path) -> Recovered:
    """Write the verified beginning of ``flight`` (opened with ``salvage``) as a new bag into ``directory``.

    Metadata, parameters, times, definitions and QoS are kept. Raises BagWriteError if ``directory`` holds something
    or the new bag could not be finished.
    """
    definitions = {
        topic.type: Definition(topic.type, flight.definition_of(name), topic.type_hash)
        for name, topic in flight.topics.items()
        if name not in flight.unreadable
    }
    start = {key: value for key, value in flight.metadata.items() if key not in _WRITER_NOTES}
    bag = BagWriter(directory, metadata=start, parameters=flight.parameters_text, message_limit=_MESSAGE_LIMIT)
    handles = {
        name: bag.add_topic(name, definitions[topic.type], qos_of(topic.offered_qos))
        for name, topic in flight.topics.items()
        if name not in flight.unreadable
    }
    for message in flight.messages():
        while bag.backlog > BACKLOG_LIMIT // 2 and not bag.error:
            time.sleep(0.01)
        if message.channel.topic in handles:
            bag.write(handles[message.channel.topic], message.data, message.log_time, message.publish_time)
    outcome = flight.metadata.get("outcome", "unknown")
    report = bag.close({"outcome": outcome, "recovered_from": flight.path.name, "damage": flight.damage or "none"})
    if report.error or report.dropped:
        raise BagWriteError(report.error or f"{directory}: {report.dropped} messages could not be written")
    return Recovered(report, sorted(flight.unreadable))
