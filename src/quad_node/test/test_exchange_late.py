"""A controller that comes into a flight under way: it stands by, and flies only with a warm memory."""

import pytest
import rclpy
from paired_controllers import (
    ASIDE,
    BOTH,
    FLYING,
    MAIN,
    REALTIME,
    SHADOW,
    answered,
    called,
    controllers,
    heard,
    told,
    topics_of,
    warm,
)


@pytest.fixture
def make(monkeypatch):
    with controllers(monkeypatch) as built:
        yield built


@pytest.mark.parametrize("shadow", [True, False])
def test_who_comes_late_stands_by_whatever_its_role_and_flies_only_with_a_warm_memory(make, shadow):
    node = make(REALTIME, shadow=shadow)
    told(node, node.role, 50)  # of its former life
    assert node.comes_late(100)
    step = warm(node, 100, 1.9)
    node.exchange._heard -= 1.0
    assert topics_of(node, step + 50) == (ASIDE if shadow else [])  # the other is silent, and so is this one: too cold
    assert called(node) == (False, "its memory is 0.00 s old, expected 2 s of answers without a gap")
    assert node.counters["not_warm"] == 1
    last = warm(node, step + 50) - 5
    node.exchange._heard -= 1.0
    assert topics_of(node, last + 10) == (ASIDE if shadow else [])
    assert topics_of(node, last + 15) == (BOTH if shadow else FLYING)  # more than 20 ms
    assert node.exchange._takeover == (last + 15, not shadow)
    told(node, MAIN if shadow else SHADOW, last + 10)
    assert topics_of(node, last + 20) == (BOTH if shadow else FLYING)


def test_who_has_heard_nothing_of_the_other_does_not_replace_it(make):
    node = make(shadow=False)
    node.comes_late(100)
    for step in range(100, 1200, 5):
        answered(node, step)
    assert called(node) == (False, "nothing heard of shadow_position_controller")


@pytest.mark.parametrize("late", ["this one", "the other"])
def test_in_lockstep_two_memories_are_not_taken_for_each_other_in_a_hurry(make, late):
    node = make(shadow=late == "the other")
    if late == "this one":
        node.comes_late(100)
    else:
        told(node, MAIN, 50, memory_step=40)
    step = warm(node, 100)
    answered(node, step)
    for repeats in range(4):
        assert not node.exchange.flies, repeats
        node.on_repeat(step)
    assert set(FLYING) <= {publisher.topic_name for publisher, _ in node.answers}


@pytest.mark.parametrize(("gap", "accepted"), [(10, True), (15, False)])
def test_a_gap_is_what_a_controller_would_have_been_replaced_for(make, gap, accepted):
    node = make(REALTIME)
    last = warm(node) - 5
    heard(node, last + gap)
    answered(node, last + gap)
    assert called(node)[0] == accepted


@pytest.mark.parametrize(("words", "takes_part"), [(["flight.standby:=false"], [True, False]), ([], [True, True])])
def test_without_a_standby_a_controller_that_comes_late_is_silent_and_a_shadow_computes(make, words, takes_part):
    assert make(*words).comes_late(100) == takes_part[0]
    rclpy.try_shutdown()
    node = make(*words, shadow=False)
    assert [node.comes_late(100) for _ in range(2)] == [takes_part[1]] * 2
    assert node.counters["came_late"] == (not takes_part[1])
