"""How long the recorder holds a lockstep flight back for a shadow controller."""

import pytest

from quad_flight_log.recorder import shadow_pace
from quad_flight_log.recorder.shadow_pace import ShadowPace

PERIOD = 2_000_000
TOPIC = "shadow/wrench_setpoint"
PERIODS = {"shadow_attitude_controller": 1, "shadow_position_controller": 5}


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

    found = Clock()
    monkeypatch.setattr(shadow_pace, "time", found)
    return found


def pace(*topics):
    found = ShadowPace(PERIOD)
    for topic in topics:
        found.expect(topic)
    return found


def test_without_a_shadow_all_that_is_complete_may_be_acknowledged(clock):
    assert pace().leave(1234) == 1234
    assert pace().answered(1234, {})


def test_a_living_shadow_may_be_so_far_behind_that_nothing_of_it_is_lost(clock):
    found = pace(TOPIC)
    found.add(TOPIC, 1000 * PERIOD)
    assert found.leave(1128) == 1128
    assert found.leave(1300) == 1128
    clock.now += 1.9
    assert found.leave(1300) == 1128


def test_who_waits_for_a_shadow_waits_two_seconds_and_again_once_it_speaks(clock):
    found = pace(TOPIC)
    found.add(TOPIC, 1000 * PERIOD)
    clock.now += 2.1
    assert found.leave(1300) == 1300
    found.add(TOPIC, 1001 * PERIOD)
    assert found.leave(1300) == 1129


def test_a_shadow_that_never_speaks_is_waited_for_from_the_beginning_of_the_flight(clock):
    found = pace(TOPIC)
    clock.now += 60.0
    assert found.leave(200) == 127
    clock.now += 2.1
    assert found.leave(200) == 200


def test_the_slowest_of_two_shadows_counts(clock):
    found = pace(TOPIC, "shadow/attitude_setpoint")
    found.add(TOPIC, 900 * PERIOD)
    found.add("shadow/attitude_setpoint", 300 * PERIOD)
    assert found.leave(900) == 428


def test_all_is_answered_with_the_last_step_that_a_shadow_is_asked_for(clock):
    found = pace("shadow/attitude_setpoint")
    found.add("shadow/attitude_setpoint", 10 * PERIOD)
    assert found.answered(14, PERIODS)
    assert not found.answered(15, PERIODS)
