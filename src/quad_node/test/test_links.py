"""Second publishers of a flight's topics, as the graph shows them."""

from types import SimpleNamespace

import pytest
from rclpy.qos import QoSPolicyKind

from quad_node.links import described, missing, qos_events, second_senders

pytestmark = pytest.mark.unit


PAIR = {"wrench_setpoint": ("attitude_controller", "shadow_attitude_controller")}


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
    assert [event[1:] for event in events] == [
        ("other_qos", "state: a publisher of other reliability; nothing of it is received")
    ]


def test_a_standby_is_a_second_sender_by_right():
    graph = Graph({"wrench_setpoint": [("/", "attitude_controller"), ("/", "shadow_attitude_controller")]})
    assert second_senders(graph, ["wrench_setpoint"], PAIR) == {}
    assert list(second_senders(graph, ["wrench_setpoint"])) == ["wrench_setpoint"]
    expected = sources(graph, wrench_setpoint="attitude_controller")
    assert missing(graph, [], expected, PAIR) == []
    graph.publishers["wrench_setpoint"].pop()
    assert missing(graph, [], expected, PAIR) == ["wrench_setpoint of attitude_controller"]


def test_a_writer_that_the_graph_shows_is_missing_until_the_reader_has_matched_it():
    graph, unmatched = Graph({"state": [("/", "simulator")]}), SimpleNamespace(get_publisher_count=lambda: 0)
    assert missing(graph, [], {"state": (unmatched, "simulator")}) == ["state of simulator"]


def test_who_was_started_again_in_flight_is_no_third_sender_beside_its_ghost():
    names = ["attitude_controller", "attitude_controller", "shadow_attitude_controller"]
    graph = Graph({"wrench_setpoint": [("/uav1", name) for name in names]})
    assert second_senders(graph, ["wrench_setpoint"], PAIR, flying=True) == {}
    # before the flight both would fly
    assert list(second_senders(graph, ["wrench_setpoint"], PAIR)) == ["wrench_setpoint"]
    graph.publishers["wrench_setpoint"][1] = ("_NODE_NAMESPACE_UNKNOWN_", "_NODE_NAME_UNKNOWN_")
    assert second_senders(graph, ["wrench_setpoint"], PAIR, flying=True) == {}
    graph.publishers["wrench_setpoint"][1] = ("/uav1", "attitude_controller")
    graph.publishers["wrench_setpoint"].append(("/uav1", "stranger"))
    assert list(second_senders(graph, ["wrench_setpoint"], PAIR, flying=True)) == ["wrench_setpoint"]
    # without a standby nothing makes two right
    assert list(second_senders(graph, ["wrench_setpoint"], flying=True)) == ["wrench_setpoint"]


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
