"""The rules of check_plant on single messages made by hand: each broken one is named, good ones break none."""

import zlib
from types import SimpleNamespace

import pytest

from quad_core.flight_parameters import FlightParameters
from quad_core.parameters import build
from quad_core.types import Quat, Vec3, VehicleState
from quad_dynamics.check_plant.rules import ACTUATION, Report, Rules

PERIOD = 2_000_000
HASH = "a1b2"
STATUS = {"role": "simulator", "run_id": "mine", "interface_hash": HASH, "plant_period": PERIOD, "state": 1}
RUN = zlib.crc32(b"mine")
NAN = float("nan")
RUN_ID, SAME_MESSAGES = "the vehicle has the flight's run id", "the vehicle was built with the same quad_msgs"
NUMBER = "state and actuation carry the number of the vehicle's run"
BOUNDS = "state is finite, within bounds, its quaternion of norm 1"
ORDER, FINITE = "steps come in order, none left out", "actuation is finite"


class Given(Rules):
    """Rules, and messages written by hand to break them."""

    def __init__(self, mode="lockstep"):
        self.report = Report()
        super().__init__(self.report, build(FlightParameters, {"run_id": "mine", "mode": mode}), HASH)

    def has_status(self, **changed):
        self.status(SimpleNamespace(**{**STATUS, **changed}))

    def has_phase(self, **changed):
        self.phase(SimpleNamespace(**{"run_id": "mine", "interface_hash": "", "state": 1, **changed}))

    def at(self, step, stamp=None, **changed):
        return self.state(VehicleState(**changed), step, step * PERIOD if stamp is None else stamp)

    def acts(self, step, thrust=5.5):
        self.actuation(step, (thrust, 0.0, 0.0, 0.0))


def test_good_messages_break_no_rule():
    given = Given()
    given.has_status()
    given.has_phase()
    for step in range(3):
        given.run("state", RUN)
        assert not given.at(step)
        given.acts(step)
        given.optional("truth", step)
    given.flight()
    assert given.report.broken == {}


@pytest.mark.parametrize(
    ("broken", "rule"),
    [
        (lambda g: g.has_status(run_id="yours"), RUN_ID),
        (lambda g: g.has_status(interface_hash="0"), SAME_MESSAGES),
        (lambda g: g.has_status(interface_hash=""), SAME_MESSAGES),
        (lambda g: g.has_status(plant_period=3), "flight/nodes: plant_period is flight.plant_period"),
        (lambda g: g.has_status(role="plant"), "flight/nodes: the vehicle has the role simulator"),
        (lambda g: g.has_phase(run_id="yours"), RUN_ID),
        (lambda g: g.has_phase(interface_hash="0"), SAME_MESSAGES),
        (lambda g: g.run("actuation", 0), NUMBER),
        (lambda g: g.run("actuation", RUN + 1), NUMBER),
        (lambda g: g.at(5), "the first state is step 0"),
        (lambda g: g.at(0, 1), "stamp of state = step x flight.plant_period"),
        (lambda g: g.at(0, v_w=Vec3(0.0, NAN, 0.0)), BOUNDS),
        (lambda g: g.at(0, q_wb=Quat(0.0, 0.0, 0.0, 1.1)), BOUNDS),
        (lambda g: (g.at(0), g.at(0, p_w=Vec3(0.0, 0.0, 1e-6))), "the state of a step comes once"),
        (lambda g: (g.at(0), g.at(2)), ORDER),
        (lambda g: (g.at(0), g.at(1), g.at(0)), ORDER),
        (lambda g: (g.acts(0), g.acts(2)), ACTUATION),
        (lambda g: g.acts(0, NAN), FINITE),
        (lambda g: g.acts(0, float("inf")), FINITE),
        (lambda g: [g.optional("truth", step) for step in (0, 1, 11)], "truth is sent of every step, or never"),
    ],
)
def test_a_message_that_breaks_a_rule_is_named(broken, rule):
    given = Given()
    broken(given)
    assert list(given.report.broken) == [rule]


def test_what_was_found_and_what_was_expected_are_named():
    given = Given()
    given.has_status(plant_period=3)
    given.run("actuation", 7)
    texts = list(given.report.broken.values())
    assert texts == ["found 3, expected 2000000", f"actuation: found 7, expected {RUN}, the CRC-32 of 'mine'"]


def test_in_real_time_steps_may_be_left_out_but_not_come_again():
    given = Given("realtime")
    for step in (0, 4, 9):
        given.at(step)
    assert given.report.broken == {}
    given.at(8)
    assert list(given.report.broken) == ["steps come in order"]


def test_what_never_came_is_named_at_the_end():
    given = Given()
    for step in range(102):
        given.at(step)
    given.flight()
    never = ["the vehicle says READY on flight/nodes", "flight/state is FLYING while states are sent", ACTUATION]
    assert list(given.report.broken) == never


def test_the_report_keeps_the_first_problem_of_a_rule():
    report = Report()
    for problem in ("", "late", "later"):
        report.add("stamp", problem)
    report.add("order")
    assert report.broken == {"stamp": "late"}
    assert report.text().splitlines() == ["FAIL  stamp: late", "ok    order", "1 of 2 kept, 1 broken"]
