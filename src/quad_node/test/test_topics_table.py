"""The table of topics: every role that is named exists, and what a step needs is there."""

import pytest

from quad_core.node_parameters import ALL_ROLES, SHADOWS
from quad_node import topics

STEP = [topic for topic in topics.TOPICS.values() if topic.step]


@pytest.mark.parametrize("topic", topics.TOPICS.values(), ids=lambda topic: topic.name)
def test_publishers_and_subscribers_are_roles_and_the_recorder_hears_all_but_itself(topic):
    assert set(topic.publishers) | set(topic.subscribers) <= set(ALL_ROLES)
    assert topic.publishers
    assert topic.subscribers
    if topic.publishers != (topics.RECORDER,):
        assert topics.RECORDER in topic.subscribers


@pytest.mark.parametrize("topic", STEP, ids=lambda topic: topic.name)
def test_step_topics_have_one_publisher_beside_the_relay_and_carry_stamp_and_step(topic):
    assert len([role for role in topic.publishers if role != topics.RELAY]) == 1
    assert not topic.latched
    known = topic.type.get_fields_and_field_types()
    assert ("step" in known and "stamp" in known) or "header" in known


@pytest.mark.parametrize("name", ["reference", "attitude_setpoint"])
def test_what_is_held_says_until_when(name):
    assert "next_step" in topics.TOPICS[name].type.get_fields_and_field_types()


def test_only_the_wrench_and_the_plan_command_a_simulator_in_flight():
    commands = {topic.name for topic in topics.TOPICS.values() if topics.SIMULATOR in topic.subscribers}
    assert commands == {"wrench_setpoint", "flight/plan", "flight/nodes", "flight/recorded"}


def test_what_a_shadow_answers_only_the_recorder_hears():
    told = [topic for topic in topics.TOPICS.values() if set(topic.publishers) & set(SHADOWS)]
    assert len(told) == 4
    for topic in told:
        assert topic.name.startswith(topics.SHADOW_TOPICS)
        assert topic.subscribers == (topics.RECORDER,)
        obeyed = topics.TOPICS[topic.name.removeprefix(topics.SHADOW_TOPICS)]
        assert topic.type is obeyed.type
        assert topic.history == obeyed.history == topics.STEP_HISTORY


def test_quality_of_service_loses_nothing():
    from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

    for topic in topics.TOPICS.values():
        profile = topic.qos(topics.STEP_HISTORY) if topic.step else topic.qos()
        assert profile.reliability == ReliabilityPolicy.RELIABLE
        late = DurabilityPolicy.TRANSIENT_LOCAL if topic.latched else DurabilityPolicy.VOLATILE
        assert profile.durability == late
