"""Second publishers of a flight's topics, as the graph shows them."""

from types import SimpleNamespace

import pytest
from rclpy.qos import QoSPolicyKind

from quad_node.links import Links, second_senders

pytestmark = pytest.mark.unit


class Graph:
    """A graph of {topic: [(namespace, node)]}."""

    def __init__(self, publishers):
        self.publishers = publishers

    def count_publishers(self, topic):
        return len(self.publishers.get(topic, ()))

    def get_publishers_info_by_topic(self, topic):
        return [SimpleNamespace(node_namespace=space, node_name=name) for space, name in self.publishers[topic]]


def matched(count):
    """Return a subscription that has matched ``count`` publishers."""
    return SimpleNamespace(get_publisher_count=lambda: count)


def test_other_qos_is_named_by_topic_and_policy():
    events, links = [], Links(Graph({}), (), True, False)
    links.events = SimpleNamespace(warn=lambda *event: events.append(event))
    links._on_other_qos("state", SimpleNamespace(last_policy_kind=QoSPolicyKind.RELIABILITY))
    assert events == [("other_qos", "state: a publisher of other reliability; nothing of it is received")]


def test_a_writer_that_the_graph_shows_is_missing_until_the_reader_has_matched_it():
    links = Links(Graph({"state": [("/", "simulator")]}), (), True, False)
    links.expect("state", matched(0), "simulator")
    assert links.missing() == ["state of simulator"]


@pytest.mark.parametrize(("senders", "named"), [
    ([("/", "foreign"), ("/uav1", "attitude_controller")], "2: /foreign, /uav1/attitude_controller"),
    ([("/", "attitude_controller")] * 3, "3: /attitude_controller (3 times)"),
])  # fmt: skip
def test_a_second_sender_is_named(senders, named):
    found = second_senders(Graph({"wrench_setpoint": senders}), ["wrench_setpoint"])
    assert found == [f"one publisher of wrench_setpoint, there are {named}"]


def test_what_is_missing_is_named_and_so_is_what_is_too_much():
    links = Links(Graph({"state": [("/", "simulator"), ("/", "other")]}), (), True, False)
    reference = SimpleNamespace(topic_name="/reference", get_subscription_count=lambda: 1)
    links._out = [(reference, 2, "position_controller")]
    links.expect("state", matched(2), "simulator")
    links.expect("actuation", matched(0), "simulator")
    assert links.missing() == [
        "a reader of /reference (position_controller)",
        "actuation of simulator",
        "one publisher of state, there are 2: /other, /simulator",
    ]
