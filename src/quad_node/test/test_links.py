"""Second publishers of a flight's topics, as the graph shows them."""

from types import SimpleNamespace

import pytest
from rclpy.qos import QoSPolicyKind

from quad_node.links import described, missing, qos_events, second_senders

pytestmark = pytest.mark.unit


class Graph:
    """A graph of {topic: [(namespace, node)]}."""

    def __init__(self, publishers):
        self.publishers = publishers

    def count_publishers(self, topic):
        return len(self.publishers.get(topic, ()))

    def get_publishers_info_by_topic(self, topic):
        return [SimpleNamespace(node_namespace=space, node_name=name) for space, name in self.publishers[topic]]


def sources(graph, **roles):
    """Return {topic: (a subscription that has matched what ``graph`` shows, role)}."""
    return {
        topic: (SimpleNamespace(get_publisher_count=lambda topic=topic: graph.count_publishers(topic)), role)
        for topic, role in roles.items()
    }


def test_other_qos_is_named_by_topic_and_policy():
    events = []
    found = qos_events(lambda *event: events.append(event), "state")
    found.incompatible_qos(SimpleNamespace(last_policy_kind=QoSPolicyKind.RELIABILITY))
    assert events == [("other_qos", "state: a publisher of other reliability; nothing of it is received")]


def test_a_writer_that_the_graph_shows_is_missing_until_the_reader_has_matched_it():
    graph, unmatched = Graph({"state": [("/", "simulator")]}), SimpleNamespace(get_publisher_count=lambda: 0)
    assert missing(graph, [], {"state": (unmatched, "simulator")}) == ["state of simulator"]


@pytest.mark.parametrize(
    ("senders", "named"),
    [
        ([("/", "foreign"), ("/uav1", "attitude_controller")], "2: /foreign, /uav1/attitude_controller"),
        ([("/", "attitude_controller")] * 3, "3: /attitude_controller (3 times)"),
    ],
)
def test_a_second_sender_is_named(senders, named):
    found = second_senders(Graph({"wrench_setpoint": senders}), ["wrench_setpoint"])
    assert described(found) == [f"one publisher of wrench_setpoint, there are {named}"]


def test_what_is_missing_is_named_and_so_is_what_is_too_much():
    readers = SimpleNamespace(topic_name="/reference", get_subscription_count=lambda: 1)
    graph = Graph({"state": [("/", "simulator"), ("/", "other")]})
    expected = sources(graph, state="simulator", actuation="simulator")
    assert missing(graph, [(readers, 2, "position_controller")], expected) == [
        "a reader of /reference (position_controller)",
        "actuation of simulator",
        "one publisher of state, there are 2: /other, /simulator",
    ]
