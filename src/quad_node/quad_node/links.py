"""What must be matched before a flight: readers of every topic, and one sender of each.

rclpy does not say which publisher a message came from, so a second one is found by the graph: before the flight it
keeps nodes from being ready, in flight it is an event, and it is looked for once a second.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import qos_policy_name_from_kind
from rclpy.subscription import Subscription

from quad_msgs.msg import FlightEvent

MANY_SENDERS = frozenset({"flight/nodes"})
"""Topics that every node of a flight publishes."""


def missing(
    graph: Node,
    out: Iterable[tuple[Publisher, int, str]],
    sources: Mapping[str, tuple[Subscription, str]],
) -> list[str]:
    """Return the topics that are not matched with all the nodes they need, and whose part that is.

    ``out``: (publisher, readers it needs, their roles); ``sources``: {topic: its subscription, roles that publish it}.
    What is sent before both ends have matched may be lost, and the graph may know of a writer earlier: both ends count
    what they have matched.
    """
    found = [
        f"a reader of {publisher.topic_name} ({readers})"
        for publisher, needed, readers in out
        if publisher.get_subscription_count() < needed
    ]
    found += [
        f"{name} of {role}" for name, (subscription, role) in sources.items() if not subscription.get_publisher_count()
    ]
    return found + described(second_senders(graph, sources))


def second_senders(graph: Node, topics: Iterable[str]) -> dict[str, list[str]]:
    """Return {topic: nodes that publish it} of those ``topics`` that have more than one publisher."""
    found = {}
    for topic in topics:
        # counting is all that a good flight pays for
        if topic not in MANY_SENDERS and graph.count_publishers(topic) > 1:
            names = [_full_name(info) for info in graph.get_publishers_info_by_topic(topic)]
            if len(names) > 1:
                found[topic] = sorted(names)
    return found


def described(found: Mapping[str, list[str]]) -> list[str]:
    """Return one line per topic with a second sender; a node that publishes twice is said to."""
    lines = []
    for topic, names in found.items():
        named = [name if count == 1 else f"{name} ({count} times)" for name, count in sorted(Counter(names).items())]
        lines.append(f"one publisher of {topic}, there are {len(names)}: {', '.join(named)}")
    return lines


def qos_events(report: Callable[[int, str, str], None], topic: str) -> SubscriptionEventCallbacks:
    """Return what calls ``report(severity, kind, text)`` for a publisher of ``topic`` whose QoS does not fit."""

    def on_other(info: Any) -> None:
        policy = qos_policy_name_from_kind(info.last_policy_kind).lower()
        report(FlightEvent.WARNING, "other_qos", f"{topic}: a publisher of other {policy}; nothing of it is received")

    return SubscriptionEventCallbacks(incompatible_qos=on_other)


def _full_name(info: Any) -> str:
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"
