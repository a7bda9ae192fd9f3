"""What must be matched before a flight: readers of every topic, and one sender of each.

rclpy does not say which publisher a message came from, so a second one is found by the graph: before the flight it
keeps nodes from being ready, in flight it is an event, and it is looked for once a second.
"""

import time
from collections import Counter
from collections.abc import Collection, Iterable
from functools import partial
from typing import Any

from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import qos_policy_name_from_kind
from rclpy.subscription import Subscription

from quad_node import topics
from quad_node.event_log import EventLog

MANY_SENDERS = frozenset({"flight/nodes"})
"""Topics that every node of a flight publishes."""


class Links:
    """A node's publishers and subscriptions on topics of the flight; ``events``: where a QoS that fits none is told."""

    def __init__(self, ros: Node, roles: Collection[str], lockstep: bool, shadow: bool) -> None:
        """Link ``ros`` with the nodes of ``roles``; a ``shadow`` answers on topics of its own."""
        self._ros, self._roles, self._lockstep, self._shadow = ros, roles, lockstep, shadow
        self.events: EventLog | None = None
        self._out: list[tuple[Publisher, int, str]] = []
        self._in: dict[str, tuple[Subscription, str]] = {}

    def publisher(self, topic: str, match: bool = True) -> Publisher:
        """Return a publisher of a topic, of a shadow's own for an answer; READY waits for subscribers if ``match``."""
        aside = self._shadow and topics.TOPICS[topic].step
        entry = topics.TOPICS[topics.SHADOW_TOPICS + topic if aside else topic]
        publisher = self._ros.create_publisher(entry.type, entry.wire, entry.qos(entry.history(self._lockstep)))
        readers = entry.subscribers_of(self._roles) if match else []
        self._out.append((publisher, len(readers), ", ".join(readers)))
        return publisher

    def subscribe(self, topic: str, callback: Any, depth: int = 10, raw: bool = False) -> Subscription:
        """Subscribe to a topic of the table and return it; READY waits for the publishers of a required one."""
        entry = topics.TOPICS[topic]
        if self._shadow:
            depth = max(depth, entry.history(self._lockstep))
        qos = entry.qos(depth, keep_all=self._lockstep)
        watched = SubscriptionEventCallbacks(incompatible_qos=partial(self._on_other_qos, entry.name))
        heard = self._ros.create_subscription(entry.type, entry.wire, callback, qos, raw=raw, event_callbacks=watched)
        sources = [role for role in entry.publishers if role in self._roles]
        if entry.required and entry.exists(self._roles) and sources:
            self.expect(entry.wire, heard, " or ".join(sources))
        return heard

    def expect(self, topic: str, subscription: Subscription, role: str) -> None:
        """Have READY wait for one publisher of ``topic``, which is ``role``'s."""
        self._in[topic] = subscription, role

    def missing(self) -> list[str]:
        """Return the topics that are not matched with all the nodes they need, and whose part that is.

        What is sent before both ends have matched may be lost, and the graph may know of a writer earlier: both ends
        count what they have matched.
        """
        found = [
            f"a reader of {publisher.topic_name} ({readers})"
            for publisher, needed, readers in self._out
            if publisher.get_subscription_count() < needed
        ]
        return found + self.unheard()

    def unheard(self) -> list[str]:
        """Return the topics whose publishers are missing, or are too many."""
        sources = self._in.items()
        found = [f"{name} of {role}" for name, (heard, role) in sources if not heard.get_publisher_count()]
        return found + self.second_senders()

    def second_senders(self) -> list[str]:
        """Return one line per topic that two nodes send and one may."""
        return second_senders(self._ros, self._in)

    def drain(self, patience: float) -> None:
        """Wait at most ``patience`` s until subscribers have what was sent."""
        deadline = time.monotonic() + patience
        # who hears first that this node has left drops what it has not read of it, the reason too
        for publisher, _, _ in self._out:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    def _on_other_qos(self, topic: str, info: Any) -> None:
        policy = qos_policy_name_from_kind(info.last_policy_kind).lower()
        if self.events is not None:
            self.events.warn("other_qos", f"{topic}: a publisher of other {policy}; nothing of it is received")


def second_senders(graph: Node, topics: Iterable[str]) -> list[str]:
    """Return one line for each of ``topics`` with more than one publisher; a node that publishes twice is said to."""
    lines = []
    for topic in topics:
        # counting is all that a good flight pays for
        if topic in MANY_SENDERS or graph.count_publishers(topic) < 2:
            continue
        infos = graph.get_publishers_info_by_topic(topic)
        names = Counter(f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in infos)
        if len(infos) > 1:
            named = [name if count == 1 else f"{name} ({count} times)" for name, count in sorted(names.items())]
            lines.append(f"one publisher of {topic}, there are {len(infos)}: {', '.join(named)}")
    return lines
