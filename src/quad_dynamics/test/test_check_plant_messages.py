"""The rules of check_plant on single messages made by hand: each broken one is named, good ones break none."""

import zlib
from types import SimpleNamespace

import pytest

from quad_core.flight_parameters import FlightParameters
from quad_core.parameters import build
from quad_core.types import Quat, Vec3, VehicleState
from quad_dynamics.check_plant import rules
from quad_dynamics.check_plant.report import Report

PERIOD = 2_000_000
HASH = "a1b2"
STATUS = {"role": "simulator", "run_id": "mine", "interface_hash": HASH, "plant_period": PERIOD, "state": 1}
PHASE = {"run_id": "mine", "interface_hash": "", "state": 1}
RUN = zlib.crc32(b"mine")
IN_ORDER = f"{rules.ORDER}, none left out"


def judge(mode="lockstep"):
    report = Report()
    return report, rules.Rules(report, build(FlightParameters, {"run_id": "mine", "mode": mode}), HASH)


def broken(report):
    return [finding.name for finding in report.failed]


def test_good_messages_break_no_rule():
    report, judged = judge()
    judged.status(SimpleNamespace(**STATUS))
    judged.phase(SimpleNamespace(**PHASE))
    for step in range(3):
        judged.run("state", RUN)
        assert not judged.state(VehicleState(), step, step * PERIOD)
        judged.actuation(step, (5.5, 0.0, 0.0, 0.0))
        judged.optional("truth", step)
    judged.flight()
    assert broken(report) == []
    assert judged.ready
    assert judged.flown


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({"run_id": "yours"}, rules.RUN_ID),
        ({"interface_hash": "0"}, rules.HASH),
        ({"interface_hash": ""}, rules.HASH),
        ({"plant_period": 3}, rules.PERIOD),
        ({"role": "plant"}, rules.ROLE),
    ],
)
def test_a_status_that_is_not_the_vehicle_s_is_named(changed, rule):
    report, judged = judge()
    judged.status(SimpleNamespace(**{**STATUS, **changed}))
    assert broken(report) == [rule]


@pytest.mark.parametrize(
    ("changed", "names"), [({"run_id": "yours"}, [rules.RUN_ID]), ({"interface_hash": "0"}, [rules.HASH])]
)
def test_a_phase_of_another_flight_is_named(changed, names):
    report, judged = judge()
    judged.phase(SimpleNamespace(**{**PHASE, **changed}))
    assert broken(report) == names


@pytest.mark.parametrize("run", [0, 7, RUN + 1])
def test_another_run_is_named_with_the_number_that_it_should_have(run):
    report, judged = judge()
    judged.run("actuation", run)
    [finding] = report.failed
    assert finding.name == rules.RUN
    assert f"actuation: found {run}, expected {RUN}" in finding.problem


@pytest.mark.parametrize(
    ("states", "names"),
    [
        ([(VehicleState(), 5, 5 * PERIOD)], [rules.FIRST]),
        ([(VehicleState(), 0, 1)], [rules.STAMP]),
        ([(VehicleState(v_w=Vec3(0.0, float("nan"), 0.0)), 0, 0)], [rules.BOUNDS]),
        ([(VehicleState(q_wb=Quat(0.0, 0.0, 0.0, 1.1)), 0, 0)], [rules.BOUNDS]),
        ([(VehicleState(), 0, 0), (VehicleState(p_w=Vec3(0.0, 0.0, 1e-6)), 0, 0)], [rules.ONCE]),
        ([(VehicleState(), 0, 0), (VehicleState(), 2, 2 * PERIOD)], [IN_ORDER]),
        ([(VehicleState(), 0, 0), (VehicleState(), 1, PERIOD), (VehicleState(), 0, 0)], [IN_ORDER]),
    ],
)
def test_a_state_that_breaks_a_rule_is_named(states, names):
    report, judged = judge()
    for state, step, stamp in states:
        judged.state(state, step, stamp)
    assert broken(report) == names


def test_in_real_time_steps_may_be_left_out_but_not_come_again():
    report, judged = judge("realtime")
    for step in (0, 4, 9):
        judged.state(VehicleState(), step, step * PERIOD)
    assert broken(report) == []
    judged.state(VehicleState(), 8, 8 * PERIOD)
    assert broken(report) == [rules.ORDER]


@pytest.mark.parametrize(
    ("steps", "thrust", "rule"),
    [((0, 2), 5.5, rules.ACTUATION), ((0,), float("nan"), rules.FINITE), ((0,), float("inf"), rules.FINITE)],
)
def test_an_actuation_that_lacks_or_is_not_finite_is_named(steps, thrust, rule):
    report, judged = judge()
    for step in steps:
        judged.actuation(step, (thrust, 0.0, 0.0, 0.0))
    assert broken(report) == [rule]


def test_a_topic_that_is_sent_now_and_then_is_named():
    report, judged = judge()
    for step in (0, 1, 11):
        judged.optional("truth", step)
    assert broken(report) == ["truth is sent of every step, or never"]


def test_what_never_came_is_named_at_the_end():
    report, judged = judge()
    for step in range(102):
        judged.state(VehicleState(), step, step * PERIOD)
    judged.flight()
    assert broken(report) == [rules.READY, rules.FLYING, rules.ACTUATION]
