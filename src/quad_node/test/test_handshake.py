"""Who takes part, who does not fit, who is to blame."""

from dataclasses import dataclass

import pytest

from quad_core.flight_parameters import FlightParameters
from quad_node.handshake import DONE, FAULT, READY, Handshake, is_foreign, plan_refusal, run_number

ROLES = ["trajectory", "position_controller", "attitude_controller", "recorder"]


@dataclass
class Said:
    role: str
    state: int = READY
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
    handshake, problems = shake(*(Said(role) for role in ROLES[:-1]))
    assert problems == ["", "", ""]
    assert handshake.missing() == ["recorder"]
    handshake.on_status(Said("recorder"))
    assert handshake.missing() == []


def test_a_role_that_is_only_starting_is_missing():
    handshake, _ = shake(*(Said(role, state=0) for role in ROLES))
    assert handshake.missing() == ROLES


@pytest.mark.parametrize(
    ("theirs", "ours", "foreign"),
    [("a", "a", False), ("b", "a", True), ("", "a", True), ("b", "", False), ("", "", False)],
)
def test_an_empty_run_id_belongs_to_nobody(theirs, ours, foreign):
    assert is_foreign(theirs, ours) is foreign


def test_a_failure_without_a_run_id_ends_nobodys_flight():
    handshake, problems = shake(Said("recorder", state=FAULT, detail="I am a stranger"), run_id="mine")
    assert problems == [""]
    assert handshake.missing() == ROLES


def test_a_start_that_fails_names_who_was_heard_and_does_not_belong():
    handshake, _ = shake(Said("traject", run_id="mine"), Said("trajectory", node="/eight"), run_id="mine")
    assert handshake.foreign_nodes() == (
        "; flight/nodes of /eight has run_id '', expected 'mine'; flight/nodes of /somebody has role 'traject', "
        "expected one of trajectory, position_controller, attitude_controller, recorder"
    )


def test_a_node_of_ours_that_nobody_expects_is_no_stranger():
    handshake, _ = shake(*(Said(role) for role in (*ROLES, "simulator", "odometry_relay", "commander")))
    assert handshake.foreign_nodes() == ""


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (Said("recorder", interface_hash="xyz"), ("recorder", "xyz", "abc")),
        (Said("trajectory", plant_period=1_000_000), ("trajectory", "1000000", "2000000")),
        (Said("position_controller", period_steps=0), ("position_controller", "period_steps 0", "at least 1")),
        (Said("attitude_controller", state=FAULT, detail="burst"), ("attitude_controller", "burst")),
    ],
)
def test_a_node_that_does_not_fit_is_named(said, words):
    _, (problem,) = shake(said)
    assert all(word in problem for word in words)


def test_a_shadow_that_fails_is_nobodys_problem():
    handshake = Handshake(FlightParameters(), "abc", ["shadow_attitude_controller"])
    assert handshake.missing() == ["shadow_attitude_controller"]
    assert handshake.on_status(Said("shadow_attitude_controller")) == ""
    assert handshake.missing() == []
    assert handshake.on_status(Said("shadow_attitude_controller", state=FAULT, detail="burst")) == ""


def test_nodes_of_another_run_and_unknown_roles_are_not_counted():
    handshake, problems = shake(Said("recorder", run_id="other"), Said("camera"), run_id="mine")
    assert problems == ["", ""]
    assert handshake.state("recorder") == 0


@pytest.mark.parametrize(
    ("steps", "behind"),
    [
        ((100, 100, 103, 40), ""),  # the recorder is none of the cascade
        ((100, 95, 99, 40), "position_controller does not answer step 104: its last step is 95"),
        ((95, 95, 99, 40), "trajectory does not answer step 104: its last step is 95"),
    ],
)
def test_the_first_node_of_the_cascade_that_has_not_answered_what_is_due_is_named(steps, behind):
    periods = (5, 5, 1, 1)
    said = [
        Said(role, period_steps=period, step=step) for role, period, step in zip(ROLES, periods, steps, strict=True)
    ]
    handshake, _ = shake(*said)
    expected = behind or "attitude_controller does not answer step 104: its last step is 103"
    assert handshake.behind(104) == expected


def test_where_all_have_answered_no_node_is_behind():
    handshake, _ = shake(*(Said(role, step=7) for role in ROLES[:-1]), Said("recorder"))
    assert handshake.behind(7) == ""


def test_with_a_commander_the_trajectory_is_not_waited_for():
    handshake, _ = shake(
        *(Said(role, step=7) for role in (*ROLES[1:], "commander")), Said("trajectory"), roles=[*ROLES, "commander"]
    )
    assert handshake.behind(7) == ""


@pytest.mark.parametrize(
    ("answered", "planned", "blame"),
    [(False, True, "attitude_controller"), (True, False, "trajectory"), (True, True, "recorder")],
)
def test_blame_without_complaints_follows_from_what_the_plant_misses(answered, planned, blame):
    handshake, _ = shake(*(Said(role) for role in ROLES))
    assert handshake.blame(7, 6, answered, planned).startswith(f"{blame} does not answer")


def test_where_states_come_through_a_relay_the_blame_says_so():
    handshake, _ = shake(*(Said(role) for role in ROLES), roles=[*ROLES, "odometry_relay"])
    reason = handshake.blame(7, 6, answered=False, planned=True)
    said = "attitude_controller does not answer step 7: no wrench_setpoint; its states come through odometry_relay"
    assert reason == said


def test_a_commander_that_does_not_say_its_mode_is_blamed_before_the_recorder():
    handshake, _ = shake(*(Said(role) for role in ROLES), Said("commander"), roles=[*ROLES, "commander"])
    reason = handshake.blame(7, 6, answered=True, planned=False)
    assert reason == "commander does not answer step 7: no flight/mode"


def test_period_and_end_are_taken_from_the_last_word():
    handshake, _ = shake(Said("attitude_controller", period_steps=4), Said("recorder", state=DONE, detail="saved"))
    assert handshake.period("attitude_controller") == 4
    assert handshake.period("position_controller") == 1
    assert (handshake.state("recorder"), handshake.detail("recorder")) == (DONE, "saved")


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


@pytest.mark.parametrize("end_step", [0, 2**63, 100_000_001])
def test_a_plan_that_is_no_flight_is_refused(end_step):
    assert f"end_step {end_step}, expected 1 to 100000000" in plan_refusal(end_step, 0, 2_000_000)


def test_the_first_plan_holds():
    assert plan_refusal(500, 0, 2_000_000) == ""
    assert plan_refusal(500, 500, 2_000_000) == ""
    assert "expected the first one's, 500" in plan_refusal(1, 500, 2_000_000)


@pytest.mark.parametrize(("standby", "problem"), [(True, ""), (False, "position_controller failed: diverged")])
def test_a_controller_that_fails_where_another_stands_by_ends_no_flight(standby, problem):
    failed = Said("position_controller", state=FAULT, detail="diverged")
    _, problems = shake(failed, roles=[*ROLES, "shadow_position_controller"], standby=standby)
    assert problems == [problem]
    _, problems = shake(
        Said("attitude_controller", state=FAULT), roles=[*ROLES, "shadow_position_controller"], standby=standby
    )
    assert problems != [""]


def test_the_number_of_a_run_is_the_crc_32_of_its_id():
    assert run_number("123456789") == 0xCBF43926  # the check value that CRC-32 is published with
    assert run_number("") == 0
