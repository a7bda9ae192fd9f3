"""What a stranger publishes on a flight's topics: the flight goes on, and its bag stays readable for everybody."""

import re
import sys
from contextlib import suppress

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from flying import PATIENT, ROOT, finish, start, stranger, wait_until, wait_until_flying
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import serialize_message

from quad_flight_log.bag.reader import open_flight
from quad_msgs.msg import FlightEvent
from quad_node.topics import SHADOW_TOPICS, TOPICS, latched

sys.path.insert(0, str(ROOT / "src" / "quad_flight_log" / "test"))
import foreign_readers

pytestmark = pytest.mark.flight


def payloads(kind):
    """Return payloads that are no message of ``kind``: cut, big-endian, empty, too long, no text."""
    whole = serialize_message(kind())
    found = [whole[:2], whole[:4], whole[:9], b"\0\0" + whole[2:], b"\0\7" + whole[2:], bytes(3), whole + bytes(40)]
    if kind is FlightEvent:
        found.append(serialize_message(FlightEvent(text="x" * 50)).replace(b"x" * 50, b"\xff" * 50))
    return found


@pytest.mark.wall_clock
def test_no_payload_costs_the_flight_or_its_bag(tmp_path):
    out = tmp_path / "bag"
    flight = start("hover", "--realtime", "--duration", "4", "--limits", "position_max=5", *PATIENT, "--out", out)
    domain = int(re.search(r"ROS_DOMAIN_ID=(\d+)", flight.stdout.readline())[1])
    wait_until_flying(flight, out)
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
    assert int(bag.metadata["count.not_recorded"]) >= 6 * len(aims)
    assert "not_recorded" in bag.array("flight/events")["kind"]
    seen = {topic: found for topic, found in foreign_readers.ours(out).items() if found[0]}
    assert foreign_readers.by_rosbags(out) == seen
    assert foreign_readers.by_mcap_ros2(out) == seen
