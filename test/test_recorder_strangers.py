"""A recorder that stands still, then hears what is no message: nothing is lost, everybody can read its bag."""

import os
import re
import signal
import time
from contextlib import suppress

import foreign_readers
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from flying import PATIENT, finish, last_word, start, stranger, wait_until, wait_until_flying
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import serialize_message

from quad_flight_log.reader import open_flight
from quad_msgs.msg import FlightEvent
from quad_node.topics import SHADOW_TOPICS, TOPICS, latched

pytestmark = pytest.mark.flight

PERIOD = 2_000_000  # ns
PLANT = ("state", "truth", "disturbance", "actuation")


def payloads(kind):
    """Return payloads that are no message of ``kind``: cut, big-endian, empty, too long, no text."""
    whole = serialize_message(kind())
    found = [whole[:2], whole[:4], whole[:9], b"\0\0" + whole[2:], b"\0\7" + whole[2:], bytes(3), whole + bytes(40)]
    if kind is FlightEvent:
        found.append(serialize_message(FlightEvent(text="x" * 50)).replace(b"x" * 50, b"\xff" * 50))
    return found


@pytest.mark.wall_clock
def test_neither_a_second_of_standing_still_nor_any_payload_costs_a_message_or_the_bag(tmp_path):
    out = tmp_path / "bag"
    flight = start("hover", "--realtime", "--duration", "5", "--limits", "position_max=5", *PATIENT, "--out", out)
    domain = int(re.search(r"ROS_DOMAIN_ID=(\d+)", flight.stdout.readline())[1])
    recorder = wait_until_flying(flight, out)["recorder"]
    time.sleep(0.5)
    os.kill(recorder, signal.SIGSTOP)
    time.sleep(1.0)
    os.kill(recorder, signal.SIGCONT)
    with stranger(domain) as node:
        others = (SHADOW_TOPICS, "flight/plan")  # nobody answers there; what comes there too long would be a plan
        read = [topic for topic in TOPICS.values() if not (topic.only_with or topic.name.startswith(others))]
        aims = [(topic.name, topic.type) for topic in read]
        aims.append(("/diagnostics", DiagnosticArray))
        made = {name: node.create_publisher(kind, name, latched(20)) for name, kind in aims}
        wait_until(lambda: all(each.get_subscription_count() for each in made.values()), 20.0, "subscribers")
        for name, kind in aims:
            for payload in payloads(kind):
                with suppress(rclpy_implementation.RCLError):  # longer than any message of a type without texts
                    made[name].publish(payload)
        made["flight/events"].publish(serialize_message(FlightEvent(text="x" * 70_000_000)))
        done = finish(flight)
    assert done.returncode == 0, done.stdout + done.stderr
    bag = open_flight(out)
    assert (bag.truncated, bag.unreadable) == (False, {})
    steps = {topic: np.unique(bag.array(topic)["stamp_ns"]) for topic in PLANT}
    missing = {topic: len(range(0, stamps[-1] + 1, PERIOD)) - len(stamps) for topic, stamps in steps.items()}
    assert max(missing.values()) <= last_word(bag, "simulator", "overruns"), missing
    assert [name for name in bag.metadata if name.startswith("missing.")] == []
    assert int(bag.metadata["last_step"]) == steps["truth"][-1] // PERIOD
    assert int(bag.metadata["count.not_recorded"]) >= 6 * len(aims)
    assert "not_recorded" in bag.array("flight/events")["kind"]
    seen = {topic: found for topic, found in foreign_readers.ours(out).items() if found[0]}
    assert foreign_readers.by_rosbags(out) == seen
    assert foreign_readers.by_mcap_ros2(out) == seen
