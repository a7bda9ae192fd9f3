"""All pairs of mode and condition, all pairs of faults at once, all sequences of three: the table walked."""

import itertools

import pytest
from mode_cases import EXPECTED, HEALTH, SEVERITY, after, in_mode

from quad_commander.mode_table import GRANTED, IN_THE_AIR, TABLE, Condition
from quad_core.enumerations import Mode, Request


def test_the_table_is_the_one_on_paper():
    assert len(EXPECTED) == len(Mode) * len(Condition)
    for (mode, condition), expected in EXPECTED.items():
        assert TABLE[mode][condition] == expected, (mode.name, condition.name)


@pytest.mark.parametrize("condition", HEALTH, ids=lambda condition: condition.name)
@pytest.mark.parametrize("mode", Mode, ids=lambda mode: mode.name)
def test_each_condition_in_each_mode(mode, condition):
    decision, memory = after(in_mode(mode), condition)
    expected = EXPECTED[mode, condition]
    assert (Mode(decision.mode), Mode(memory.mode)) == (expected, expected)
    assert decision.changed == (expected != mode)
    if decision.changed:
        # 76 deg is more than 60 deg too, and so on: the reason is one that leads there
        assert EXPECTED[mode, Condition(decision.reason)] == expected


@pytest.mark.parametrize("mode", Mode, ids=lambda mode: mode.name)
def test_a_healthy_vehicle_stays_in_its_mode(mode):
    decision, _ = after(in_mode(mode))
    assert (decision.mode, decision.changed, decision.raised) == (mode, False, frozenset())


@pytest.mark.parametrize("mode", IN_THE_AIR, ids=lambda mode: mode.name)
def test_of_two_faults_at_once_the_more_severe_wins(mode):
    for pair in itertools.combinations(HEALTH, 2):
        decision, _ = after(in_mode(mode), *pair)
        expected = max((EXPECTED[mode, fault] for fault in pair), key=SEVERITY)
        assert Mode(decision.mode) == expected, [fault.name for fault in pair]


@pytest.mark.parametrize("mode", [Mode.ARMING, *IN_THE_AIR], ids=lambda mode: mode.name)
def test_every_sequence_of_two_faults_follows_the_table(mode):
    for sequence in itertools.product(HEALTH, repeat=2):
        walk(mode, sequence)


def test_every_sequence_of_three_faults_follows_the_table():
    # from MISSION, the least severe mode in which each of them can be raised
    for sequence in itertools.product(HEALTH, repeat=3):
        walk(Mode.MISSION, sequence)


def walk(start, sequence):
    memory, expected, lasting, waits = in_mode(start), start, set(), start in (Mode.MISSION, Mode.HOLD)
    for fault in sequence:
        before = expected
        raised = {fault} | lasting
        if fault in (Condition.REFERENCE_LATE, Condition.REFERENCE_LOST) and not waits:
            raised.discard(fault)
        steps = [EXPECTED[before, each] for each in raised if EXPECTED[before, each] != before]
        expected = max(steps, default=before, key=SEVERITY)
        decision, memory = after(memory, fault)
        assert Mode(decision.mode) == expected, ([each.name for each in sequence], fault.name)
        assert before not in IN_THE_AIR or SEVERITY(decision.mode) >= SEVERITY(before)
        waits = expected == Mode.MISSION or (expected == Mode.HOLD and waits)
        if expected == Mode.DISARMED:
            lasting = set()
        elif fault in (Condition.BATTERY_LOW, Condition.END_ASKED):
            lasting.add(fault)


def test_kill_is_final_and_pilot_gives_no_way_back():
    for fault, request in itertools.product([None, *HEALTH], (Request.NONE, *GRANTED)):
        faults = [] if fault is None else [fault]
        decision, _ = after(in_mode(Mode.KILL), *faults, request=request)
        assert decision.mode == Mode.KILL
        decision, _ = after(in_mode(Mode.PILOT), *faults, request=request)
        assert decision.mode == (Mode.KILL if request == Request.KILL else Mode.PILOT)
        assert decision.guard_request in (0, 3)


def test_requests_lead_where_the_paper_says():
    air = ["TAKEOFF", "MISSION", "HOLD", "LAND", "DESCEND"]
    paper = {
        Request.ARM: {"DISARMED": "ARMING", "ARMING": "ARMING"},
        Request.TAKEOFF: {"DISARMED": "ARMING", "ARMING": "ARMING"},
        Request.MISSION: {"HOLD": "MISSION"},
        Request.HOLD: dict.fromkeys(air, "HOLD"),
        Request.GOTO: dict.fromkeys(air, "HOLD"),
        Request.LAND: dict.fromkeys(air, "LAND"),
        Request.DESCEND: dict.fromkeys(air, "DESCEND"),
        Request.DISARM: {"DISARMED": "DISARMED", "ARMING": "DISARMED", "PILOT": "DISARMED"},
        Request.KILL: {mode.name: "KILL" for mode in Mode},
    }
    found = {request: {here.name: there.name for here, there in row.items()} for request, row in GRANTED.items()}
    assert found == paper
