"""Who takes part, who does not fit, who is to blame."""

from dataclasses import dataclass

import pytest

from quad_core.enumerations import NodeState
from quad_core.flight_parameters import FlightParameters
from quad_node.handshake import Handshake, is_foreign, plan_refusal, run_number

ROLES = ["trajectory", "position_controller", "attitude_controller", "recorder"]


@dataclass
class Said:
    role: str
    state: int = NodeState.READY
    run_id: str = ""
    interface_hash: str = "abc"
    period_steps: int = 1
    plant_period: int = 2_000_000
    step: int = 0
    detail: str = ""
    node: str = "/somebody"


def shake(*said: Said, roles: list[str] = ROLES, **flight) -> tuple[Handshake, list[str]]:
    handshake = Handshake(FlightParameters(**flight), "abc", roles)
    return handshake, [handshake.on_status(status) for status in said]


def test_all_roles_must_be_ready():
    handshake, problems = shake(*(Said(role) for role in ROLES[:-1]), Said("recorder", state=0))
    assert problems == ["", "", "", ""]
    assert handshake.missing() == ["recorder"]
    handshake.on_status(Said("recorder"))
    assert handshake.missing() == []
    handshake.on_status(Said("recorder", state=0, detail="state of simulator"))
    assert handshake.missing() == ["recorder (state of simulator)"]


@pytest.mark.parametrize(
    ("theirs", "ours", "foreign"), [(7, 7, False), (8, 7, True), (0, 7, True), (8, 0, False), (0, 0, False)]
)
def test_a_message_without_a_number_belongs_to_nobody(theirs, ours, foreign):
    assert is_foreign(theirs, ours) is foreign


@pytest.mark.parametrize("run_id", ["", "other"])
def test_a_failure_of_another_run_or_of_none_ends_no_flight(run_id):
    handshake, problems = shake(Said("recorder", state=NodeState.FAULT, run_id=run_id), Said("camera"), run_id="mine")
    assert problems == ["", ""]
    assert (handshake.missing(), handshake.known) == (ROLES, {})


def test_a_start_that_fails_names_the_nodes_that_do_not_belong():
    handshake, _ = shake(Said("traject", run_id="mine"), Said("trajectory", node="/eight"), run_id="mine")
    assert handshake.foreign_nodes() == (
        "; flight/nodes of /eight has run_id '', expected 'mine'; flight/nodes of /somebody has role 'traject', "
        "expected one of trajectory, position_controller, attitude_controller, recorder"
    )


@pytest.mark.parametrize(("said", "words"), [
    (Said("recorder", interface_hash="xyz"), ("recorder", "xyz", "abc")),
    (Said("trajectory", plant_period=1_000_000), ("trajectory", "1000000", "2000000")),
    (Said("position_controller", period_steps=0), ("position_controller", "period_steps 0", "at least 1")),
    (Said("attitude_controller", state=NodeState.FAULT, detail="burst"), ("attitude_controller", "burst")),
])  # fmt: skip
def test_a_node_that_does_not_fit_is_named(said, words):
    _, (problem,) = shake(said)
    assert all(word in problem for word in words)


def test_a_flight_waits_for_a_shadow_and_goes_on_without_it():
    handshake = Handshake(FlightParameters(), "abc", ["shadow_attitude_controller"])
    assert handshake.missing() == ["shadow_attitude_controller"]
    assert handshake.on_status(Said("shadow_attitude_controller")) == ""
    assert handshake.missing() == []
    assert handshake.on_status(Said("shadow_attitude_controller", state=NodeState.FAULT, detail="burst")) == ""


@pytest.mark.parametrize(("steps", "behind"), [
    ((100, 100, 103, 40), ""),  # the recorder is none of the cascade
    ((100, 95, 99, 40), "position_controller does not answer step 104"),
    ((95, 95, 99, 40), "trajectory does not answer step 104"),
])  # fmt: skip
def test_the_first_node_of_the_cascade_that_has_not_answered_what_is_due_is_named(steps, behind):
    periods = (5, 5, 1, 1)
    said = [
        Said(role, period_steps=period, step=step) for role, period, step in zip(ROLES, periods, steps, strict=True)
    ]
    handshake, _ = shake(*said)
    expected = behind or "attitude_controller does not answer step 104"
    assert handshake.behind(104) == expected


@pytest.mark.parametrize("commander", [[], ["commander"]])
def test_no_step_waits_for_the_recorder_nor_with_a_commander_for_the_trajectory(commander):
    roles = [*ROLES, *commander]
    handshake, _ = shake(*(Said(role, step=7) for role in roles if role != "recorder"), Said("recorder"), roles=roles)
    if commander:
        handshake.on_status(Said("trajectory"))
    assert handshake.behind(7) == ""


NO_WRENCH = "attitude_controller does not answer step 7: no wrench_setpoint"


@pytest.mark.parametrize(("guests", "answered", "planned", "blame"), [
    ([], False, True, NO_WRENCH),
    (["odometry_relay"], False, True, f"{NO_WRENCH}; its states come through odometry_relay"),
    ([], True, False, "trajectory does not answer step 7: no flight/plan"),
    (["commander"], True, False, "commander does not answer step 7: no flight/mode"),
    ([], True, True, "recorder does not answer: flight/recorded is at step 6, the plant at 7"),
])  # fmt: skip
def test_what_the_plant_misses_names_the_node_that_gives_it(guests, answered, planned, blame):
    roles = [*ROLES, *guests]
    handshake, _ = shake(*(Said(role) for role in roles), roles=roles)
    assert handshake.blame(7, 6, answered, planned) == blame


@pytest.mark.parametrize(
    ("trajectory", "position", "attitude", "misfit"),
    [(5, 5, 1, ""), (5, 10, 2, ""), (1, 1, 1, ""), (5, 5, 2, "attitude_controller"), (3, 5, 1, "position_controller")],
)
def test_a_stage_whose_period_does_not_fit_its_input_is_refused(trajectory, position, attitude, misfit):
    periods = {"trajectory": trajectory, "position_controller": position, "attitude_controller": attitude}
    _, problems = shake(*(Said(role, period_steps=periods.get(role, 1)) for role in ROLES))
    found = [problem for problem in problems if problem]
    assert bool(found) == bool(misfit)
    assert all(problem.startswith(f"flight/nodes: {misfit} answers every {periods[misfit]}") for problem in found)


def test_a_plan_that_is_no_flight_is_refused_and_the_first_one_holds():
    for end_step in (0, 2**63, 100_000_001):
        assert f"end_step {end_step}, expected 1 to 100000000" in plan_refusal(end_step, 0, 2_000_000)
    assert plan_refusal(500, 0, 2_000_000) == plan_refusal(500, 500, 2_000_000) == ""
    assert "expected the first one's, 500" in plan_refusal(1, 500, 2_000_000)


def test_the_number_of_a_run_is_the_crc_32_of_its_id():
    assert run_number("123456789") == 0xCBF43926  # the check value that CRC-32 is published with
    assert run_number("") == 0
