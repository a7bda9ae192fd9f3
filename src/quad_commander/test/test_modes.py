"""Requests, timers, latches and hand-overs of the commander's step."""

import itertools
import random

import pytest
from mode_cases import HEALTH, LONG, PARAMETERS, after, health, in_mode

from quad_commander import modes
from quad_commander.mode_table import Condition
from quad_commander.modes import Inputs
from quad_core.enumerations import Answer, GuardMode, GuardReason, GuardRequest, Mode, Request
from quad_core.types import GuardStatus

DT = 0.01


def fly(memory, seconds, request=Request.NONE, **seen):
    """Fly ``seconds`` at 100 Hz; the request is made in the first step."""
    decision = None
    for number in range(round(seconds / DT)):
        asked = request if number == 0 else Request.NONE
        decision, memory = modes.step(PARAMETERS, memory, Inputs(**seen), asked, DT)
    return decision, memory


def test_arming_alone_does_not_take_off():
    decision, _ = fly(modes.Memory(), 5.0, Request.ARM, checks_passed=True)
    assert decision.mode == Mode.ARMING


@pytest.mark.parametrize("mode", [Mode.LAND, Mode.DESCEND])
def test_contact_is_what_the_guard_says(mode):
    assert fly(in_mode(mode), 3.0)[0].mode == mode
    assert fly(in_mode(mode), 0.01, landed=True)[0].mode == Mode.DISARMED


@pytest.mark.parametrize("mode", [Mode.TAKEOFF, Mode.MISSION, Mode.HOLD])
def test_contact_disarms_no_vehicle_that_is_not_landing(mode):
    assert fly(in_mode(mode), 3.0, landed=True)[0].mode == mode


def test_a_hold_that_was_asked_for_waits_for_no_mission():
    _, memory = fly(in_mode(Mode.MISSION), 0.02, Request.HOLD)
    assert fly(memory, 5.0, reference_age=100.0)[0].mode == Mode.HOLD
    _, memory = fly(in_mode(Mode.MISSION), 0.02, plan_ended=True)
    assert fly(memory, 5.0, reference_age=100.0)[0].mode == Mode.HOLD


def test_a_request_into_a_mode_that_would_not_last_is_refused_by_name():
    _, memory = fly(in_mode(Mode.MISSION), 0.02, battery=0.1)
    # the battery recovers without load, and still
    decision, _ = fly(memory, DT, Request.HOLD, battery=0.5)
    assert (decision.mode, decision.answer, decision.blocked_by) == (Mode.LAND, Answer.REFUSED, Condition.BATTERY_LOW)
    decision, _ = fly(in_mode(Mode.HOLD), DT, Request.MISSION, reference_age=0.5)
    assert (decision.mode, decision.blocked_by) == (Mode.HOLD, Condition.REFERENCE_LATE)


def test_a_pilot_may_disarm_on_the_ground_only():
    assert fly(in_mode(Mode.PILOT), 1.0, Request.DISARM)[0].mode == Mode.PILOT
    _, memory = fly(in_mode(Mode.PILOT), 0.6, landed=True)
    assert fly(memory, DT, Request.DISARM, landed=True)[0].mode == Mode.DISARMED


def test_faults_win_over_a_request_of_the_same_step():
    decision, _ = after(in_mode(Mode.MISSION), Condition.GUARD_KILLED, request=Request.LAND, dt=DT)
    assert decision.mode == Mode.KILL


def test_going_down_is_never_refused():
    for faults in itertools.combinations(HEALTH, 2):
        decision, _ = after(in_mode(Mode.MISSION), *faults, request=Request.DESCEND)
        assert decision.answer == Answer.DONE
        assert decision.mode >= Mode.DESCEND


def descending(condition):
    return {"guard": GuardStatus(mode=GuardMode.DESCEND, condition=condition)}


def test_the_guard_gives_back_on_request_within_its_time():
    decision, memory = fly(in_mode(Mode.MISSION), 0.1, **descending(GuardReason.WRENCH_LOST))
    assert (decision.mode, decision.guard_request) == (Mode.DESCEND, GuardRequest.DESCEND)
    # what was wrong is over: the guard descends because it is asked to
    decision, memory = fly(memory, 0.2, **descending(GuardReason.REQUESTED))
    assert decision.mode == Mode.DESCEND
    decision, memory = fly(memory, 0.2, Request.HOLD, **descending(GuardReason.GOOD))
    assert (decision.mode, decision.guard_request) == (Mode.HOLD, GuardRequest.RELEASE)
    given, _ = fly(memory, 1.0)
    assert (given.mode, given.guard_request) == (Mode.HOLD, GuardRequest.NONE)
    refused, _ = fly(memory, 0.5, **descending(GuardReason.GOOD))
    assert (refused.mode, refused.reason) == (Mode.DESCEND, Condition.GUARD_DESCENDS)


def test_a_guard_that_took_over_between_two_steps_is_seen():
    decision, _ = fly(in_mode(Mode.MISSION), 0.02, **descending(GuardReason.GOOD))
    assert decision.mode == Mode.DESCEND
    assert decision.guard_request == GuardRequest.DESCEND


def test_the_guard_is_never_released_without_a_request():
    rng = random.Random(1)
    for _ in range(300):
        memory = in_mode(rng.choice([Mode.TAKEOFF, Mode.MISSION, Mode.HOLD, Mode.LAND]))
        for _ in range(5):
            decision, memory = after(memory, *rng.sample(list(HEALTH), rng.randrange(3)))
            assert decision.guard_request != GuardRequest.RELEASE


def test_a_lost_recorder_is_an_event_unless_asked_to_land():
    calm = PARAMETERS._replace(land_without_recorder=False)
    decision, _ = modes.step(calm, in_mode(Mode.MISSION), health(Condition.RECORDER_LOST), Request.NONE, LONG)
    assert decision.mode == Mode.MISSION


def test_late_take_off_and_landing():
    assert fly(in_mode(Mode.TAKEOFF), 26.0)[0].mode == Mode.LAND
    assert fly(in_mode(Mode.LAND), 0.1, reference_done=True, done_time=4.9)[0].mode == Mode.LAND
    assert fly(in_mode(Mode.LAND), 0.1, reference_done=True, done_time=5.1)[0].mode == Mode.DESCEND


def test_a_new_battery_ends_what_the_old_one_raised():
    _, memory = fly(in_mode(Mode.LAND), 0.6, battery=0.1, landed=True)
    assert memory.mode == Mode.DISARMED
    decision, _ = fly(memory, DT, Request.ARM, battery=0.1)
    assert (decision.mode, decision.blocked_by) == (Mode.DISARMED, Condition.BATTERY_LOW)
    assert fly(memory, DT, Request.ARM)[0].mode == Mode.ARMING


def test_what_changes_no_mode_is_no_reason():
    decision, _ = fly(modes.Memory(), 1.0, landed=True)
    assert (decision.mode, decision.reason) == (Mode.DISARMED, modes.NO_REASON)
    _, memory = fly(in_mode(Mode.HOLD), DT, Request.MISSION)
    decision, _ = fly(memory, 1.0)
    assert (decision.mode, decision.reason) == (Mode.MISSION, modes.ON_REQUEST)


@pytest.mark.parametrize("request_", [Request.GOTO, Request.HOLD])
def test_a_vehicle_that_holds_for_a_lost_mission_and_is_asked_to_hold_waits_no_more(request_):
    _, memory = fly(in_mode(Mode.MISSION), 0.02, reference_age=0.21)
    assert (memory.mode, memory.reason) == (Mode.HOLD, Condition.REFERENCE_LATE)
    decision, memory = fly(memory, DT, request_, reference_age=0.3)
    assert (decision.mode, decision.answer, decision.reason) == (Mode.HOLD, Answer.DONE, modes.ON_REQUEST)
    assert fly(memory, 5.0, reference_age=100.0)[0].mode == Mode.HOLD


def test_a_hold_that_is_asked_for_once_the_mission_is_lost_lands():
    _, memory = fly(in_mode(Mode.MISSION), 0.02, reference_age=0.21)
    decision, _ = fly(memory, DT, Request.HOLD, reference_age=2.1)
    assert (decision.mode, decision.reason) == (Mode.LAND, Condition.REFERENCE_LOST)


def test_a_landing_that_is_asked_for_again_keeps_its_reason():
    _, memory = fly(in_mode(Mode.MISSION), 0.02, battery=0.1)
    assert fly(memory, DT, Request.LAND, battery=0.1)[0].reason == Condition.BATTERY_LOW
