"""How far the plant runs ahead of states and answers; expectations are counted by hand from stamps 8 to 16 ms apart."""

import pytest

from quad_mavlink.gate import Decision, Gate, foreign_stamp
from quad_mavlink.parameters import GateParameters

GO, WAIT, OVERDUE, UNANSWERED = Decision
WAITS = GateParameters(linger=0.01, overdue=2.0, answer_timeout=10.0)
WRENCH, SETPOINT = "wrench_setpoint", "attitude_setpoint"


def gate(stamps=(1000, 9000, 21_000, 29_000, 45_000), lag=4000):
    """Return a gate that has seen states at ``stamps`` us, each ``lag`` us after its time."""
    found = Gate(WAITS)
    found.expect({WRENCH: 1, SETPOINT: 2})
    for stamp in stamps:
        found.on_state(stamp, stamp + lag)
    return found


def test_before_the_first_state_the_plant_runs_freely():
    assert Gate(WAITS).decide(10**9, 0.0, False) == GO
    assert Gate(WAITS).decide(10**9, 0.0, True) == GO


def test_it_runs_freely_until_a_state_may_be_due_and_then_lingers():
    found = gate()  # the last state is of 45 ms and came at 49 ms; 8 ms later the next may come
    assert found.decide(57_000, 0.0, True) == GO
    assert found.decide(57_001, 0.0, True) == WAIT
    assert found.decide(61_000, 0.0099, True) == WAIT
    assert found.decide(61_000, 0.0101, True) == GO


def test_at_the_largest_spacing_it_waits_for_long_and_says_so_once():
    found = gate()
    assert found.decide(65_000, 0.0101, True) == GO  # 16 ms
    assert found.decide(69_000, 1.9, True) == WAIT
    assert found.decide(69_000, 2.1, True) == OVERDUE
    assert found.decide(73_000, 0.0, True) == WAIT  # lost or not: a step at a time
    assert found.decide(73_000, 0.0101, True) == GO
    found.on_state(73_000, 77_000)
    assert found.decide(77_000 + 40_000, 1.9, True) == WAIT  # the next state is awaited again


def test_before_and_after_the_flight_it_only_lingers():
    found = gate()
    found.on_published(0)
    assert found.decide(200_000, 0.0, False) == WAIT
    assert found.decide(200_000, 0.0101, False) == GO


def test_nothing_goes_on_before_every_answer_to_the_last_state_is_out():
    found = gate()
    found.on_published(4)
    assert found.missing == f"{WRENCH}, {SETPOINT}"
    found.on_answer(WRENCH, 4)
    assert found.decide(49_000, 9.9, True) == WAIT
    found.on_answer(SETPOINT, 3)  # of an older state
    assert found.decide(49_000, 9.9, True) == WAIT
    found.on_answer(SETPOINT, 4)
    assert found.missing == ""
    assert found.decide(49_000, 0.0, True) == GO


def test_controllers_that_never_answer_end_the_wait():
    found = gate()
    found.on_published(4)
    assert found.decide(49_000, 10.1, True) == UNANSWERED


def test_a_controller_is_not_asked_again_within_its_period():
    found = gate()
    found.on_published(4)
    found.on_answer(WRENCH, 4)
    found.on_answer(SETPOINT, 4)
    found.on_published(5)
    assert found.missing == WRENCH
    found.on_answer(WRENCH, 5)
    found.on_published(6)
    assert found.missing == f"{WRENCH}, {SETPOINT}"


def test_answers_to_nothing_are_passed_over():
    found = gate()
    found.on_answer(WRENCH, 7)
    assert found.missing == ""


@pytest.mark.parametrize(
    ("stamp", "now", "ours"), [(5, 4, False), (5, 5, True), (5, 500_005, True), (5, 500_006, False)]
)
def test_a_stamp_of_another_clock_is_none_of_ours(stamp, now, ours):
    assert Gate.is_of_our_clock(stamp, now) == ours
    found = Gate(WAITS)
    found.on_state(stamp, now)
    assert (found.decide(10**9, 0.0, True) == GO) != ours


def test_how_late_states_come_is_learned_from_the_fastest():
    found = gate(lag=8000)
    found.on_state(57_000, 57_000)  # spacing 12 ms, no lag
    assert found.decide(65_000, 0.0, True) == GO
    assert found.decide(65_001, 0.0, True) == WAIT


@pytest.mark.parametrize(
    ("stamp", "word"), [(9_000_000, "1.00 s behind PX4's clock"), (10_000_001, "SYNCT 0"), (10**12, "SYNCT 0")]
)
def test_an_estimate_that_cannot_be_flown_is_late_or_of_another_clock(stamp, word):
    assert word in foreign_stamp(stamp, 10_000_000)
    assert ("SYNCT" in foreign_stamp(stamp, 10_000_000)) == (word == "SYNCT 0")
