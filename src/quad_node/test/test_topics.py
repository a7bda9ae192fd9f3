"""The table of topics: every role that is named exists, what a step needs is there, and a second sender is named."""

from types import SimpleNamespace

import pytest
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, ReliabilityPolicy

from quad_core.cascade import ALL_ROLES, COMMANDER, OPTIONAL_NODES, RECORDER, RELAY, ROLES, SHADOWS
from quad_node import topics
from quad_node.topics import Links, second_senders

STEP = [topic for topic in topics.TOPICS.values() if topic.step]


@pytest.mark.parametrize("topic", topics.TOPICS.values(), ids=lambda topic: topic.name)
def test_publishers_and_subscribers_are_roles_and_the_recorder_hears_all_but_itself(topic):
    assert set(topic.publishers) | set(topic.subscribers) <= set(ALL_ROLES)
    assert topic.publishers
    assert topic.subscribers
    if topic.publishers != (RECORDER,):
        assert RECORDER in topic.subscribers


@pytest.mark.parametrize("topic", STEP, ids=lambda topic: topic.name)
def test_step_topics_have_one_publisher_beside_the_guests_and_carry_stamp_and_step(topic):
    assert len([role for role in topic.publishers if role not in OPTIONAL_NODES]) == (topic.name != "flight/mode")
    assert (topic.wire != topic.name) == topic.latched == (topic.name == "flight/mode")
    known = topic.type.get_fields_and_field_types()
    assert ("step" in known and "stamp" in known) or "header" in known


def test_a_guest_that_gives_a_topic_stands_in_for_the_node_that_gives_it_otherwise():
    reference = topics.TOPICS["reference"]
    assert (reference.publisher_of(ROLES), len(reference.subscribers_of(ROLES))) == ("trajectory", 2)
    guided = (*ROLES, COMMANDER)
    assert (reference.publisher_of(guided), len(reference.subscribers_of(guided))) == ("commander", 3)
    assert topics.TOPICS["state"].publisher_of((*ROLES, RELAY)) == RELAY


def test_what_a_shadow_answers_only_the_recorder_hears():
    listed = [topic for topic in topics.TOPICS.values() if set(topic.publishers) & set(SHADOWS)]
    assert len(listed) == 4
    for topic in listed:
        assert topic.name.startswith(topics.SHADOW_TOPICS)
        assert topic.subscribers == (RECORDER,)
        obeyed = topics.TOPICS[topic.name.removeprefix(topics.SHADOW_TOPICS)]
        assert topic.type is obeyed.type
        assert [topic.history(mode) for mode in (True, False)] == [obeyed.history(mode) for mode in (True, False)]


def test_quality_of_service_loses_nothing():
    for topic in topics.TOPICS.values():
        assert not topic.step or topic.history(lockstep=False) >= 2000  # a pause of a second at 1 kHz
        profile = topic.qos(topics.REALTIME_HISTORY) if topic.step else topic.qos()
        # a reliable reader would not hear a driver that sends as sensors do
        lossy = topic.name == "battery_state"
        assert profile.reliability == (ReliabilityPolicy.BEST_EFFORT if lossy else ReliabilityPolicy.RELIABLE)
        late = DurabilityPolicy.TRANSIENT_LOCAL if topic.latched and not topic.step else DurabilityPolicy.VOLATILE
        assert profile.durability == late


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
    links.events = SimpleNamespace(warn=lambda *event, always: events.append((*event, always)))
    links._on_other_qos("state", SimpleNamespace(last_policy_kind=QoSPolicyKind.RELIABILITY))
    assert events == [("other_qos", "state: a publisher of other reliability; nothing of it is received", True)]


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
