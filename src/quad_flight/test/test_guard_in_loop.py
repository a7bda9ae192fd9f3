"""The guard in the loop without ROS: unseen in a flight without faults, in command when the link loses the commands."""

import math

import numpy as np
import pytest

from quad_flight.flight import fly, from_names

pytestmark = pytest.mark.unit


def flown(case, *settings, **choices):
    return fly(from_names(case, settings=settings, **choices))


def events(tmp_path, text):
    """Return the path of a scenario in which ``text`` happens."""
    path = tmp_path / "scenario.yaml"
    lines = "".join(f"        {line}\n" for line in text.splitlines())
    path.write_text(
        f"/**/simulator:\n  ros__parameters:\n    disturbance: timeline\n    timeline:\n      events: |\n{lines}"
    )
    return str(path)


@pytest.mark.parametrize(
    ("case", "plant", "preset"),
    [("hover", "rigid_body", "minimal"), ("case1", "paper", "tuned"), ("case2", "rigid_body", "tuned")],
)
def test_without_a_fault_no_bit_changes(case, plant, preset):
    guarded, bare = (
        flown(case, f"simulator.guard.enabled={on}", plant=plant, preset=preset, duration=0.5)
        for on in ("true", "false")
    )
    assert (guarded.outcome, guarded.guard) == ("ended", "")
    assert guarded.topics.keys() == bare.topics.keys()
    for topic, rows in bare.topics.items():
        assert guarded.topics[topic].tobytes() == rows.tobytes(), topic


@pytest.mark.parametrize(("case", "lost"), [("hover", 4.0), ("case2", 7.1), ("case2", 13.0), ("case2", 22.3)])
def test_a_lost_link_is_a_landing(tmp_path, case, lost):
    scenario = events(tmp_path, f"link start={lost} drop=1")
    result = flown(case, duration=40.0, scenario=scenario)
    # the last wrench is that of the step before; 50 ms are 25 steps
    begins = round(lost * 500) + 25
    assert (result.outcome, result.guard) == ("taken over", f"guard in descend since step {begins}: no good wrench")
    truth = result.topics["truth"]
    assert truth["p_w"][begins, 2] > 0.3
    last = truth[-1]
    assert -0.01 < last["p_w"][2] < 0.01
    assert np.linalg.norm(last["v_w"]) < 1.5
    x, y = last["q_wb"][:2]
    assert math.acos(1.0 - 2.0 * (x * x + y * y)) < math.radians(15.0)
    assert result.steps < result.end_step


def test_a_gap_that_is_short_enough_is_no_takeover(tmp_path):
    result = flown("hover", duration=1.0, scenario=events(tmp_path, "link start=2 end=2.048 drop=1"))
    assert (result.outcome, result.guard) == ("ended", "")


def test_the_end_of_the_plan_ends_a_takeover_too(tmp_path):
    result = flown("hover", duration=0.1, scenario=events(tmp_path, "link start=2.9 drop=1"))
    assert result.outcome == "taken over"
    assert result.steps == result.end_step


def test_a_vehicle_with_a_ground_is_down_when_its_motors_stopped(tmp_path):
    ground = ("simulator.rigid_body.ground.enabled=true", "simulator.rigid_body.ground.height=-0.1")
    result = flown("hover", *ground, duration=30.0, scenario=events(tmp_path, "link start=4 drop=1"))
    assert result.outcome == "taken over"
    last = result.topics["truth"][-1]
    assert abs(last["p_w"][2]) < 0.01
    assert np.linalg.norm(last["v_w"]) < 0.01
    assert result.topics["actuation"]["thrust"][-1] == 0.0
    assert (result.topics["actuation"]["thrust"][2100:-1] > 0.0).all()


def test_a_frozen_state_is_a_descent_on_a_prediction(tmp_path):
    result = flown("case2", duration=5.0, scenario=events(tmp_path, "freeze start=3 end=3.2"))
    assert result.guard.endswith("no good state")
    assert np.linalg.norm(result.topics["truth"][-1]["v_w"]) < 1.5


def lands_softly(result):
    """Return whether a flight came down below 1.5 m/s and 15 deg."""
    last = result.topics["truth"][-1]
    x, y = last["q_wb"][:2]
    return np.linalg.norm(last["v_w"]) < 1.5 and x * x + y * y < math.sin(math.radians(7.5)) ** 2


@pytest.mark.parametrize(
    ("case", "jumps"),
    [
        ("hover", "jump start=3.8 yaw=3.14"),
        ("hover", "jump start=3.8 end=4.6 yaw=1.7\njump start=4.4 yaw=-1.2 offset=3,0,0"),
        ("case2", "jump start=8 yaw=-2.2"),
        ("hover", "\n".join(f"jump start={3.8 + 0.1 * number:.1f} yaw=0.33" for number in range(5))),
    ],
)
def test_a_heading_that_jumps_or_creeps_away_is_named_and_landed(tmp_path, case, jumps):
    weather = "held_gaussian acceleration_sd=0.5 acceleration_clip=1.5 angular_sd=0.66 angular_clip=2 hold=2\n"
    result = flown(case, duration=30.0, scenario=events(tmp_path, weather + jumps), seed=3)
    assert result.guard.endswith("heading")
    assert lands_softly(result)


@pytest.mark.parametrize(
    "fault",
    [
        "push start=1 torque=0.05,0,0\nfreeze start=4.5 end=5.2",
        "push start=1 torque=0.015,0,0\nfreeze start=4.5",
        "push start=1 torque=0.08,0,0\nlink start=4.5 drop=1",
    ],
)
def test_a_load_off_the_centre_is_trimmed_from_the_first_step_of_a_takeover_on(tmp_path, fault):
    # 3 to 15 mm; frozen for good it comes down by prediction alone
    result = flown("hover", duration=20.0, scenario=events(tmp_path, fault))
    assert result.guard
    assert lands_softly(result)
    tilt = np.abs(result.topics["truth"]["q_wb"][2250:, :2]).max()
    assert tilt < math.sin(math.radians(5.0))


def test_a_rotor_that_weakens_beyond_the_yaw_torque_of_the_law_is_a_landing(tmp_path):
    # a tenth of a rotor of paper makes 1.2 N m about z, and the law's limit is 0.5 N m
    result = flown("hover", duration=20.0, scenario=events(tmp_path, "rotor start=4.5 number=2 effectiveness=0.894"))
    assert result.guard.endswith("spin")
    assert lands_softly(result)


@pytest.mark.parametrize("disturbance", ["none", "held_gaussian"])
def test_a_state_that_freezes_while_the_vehicle_hardly_moves_is_seen_in_150_ms(tmp_path, disturbance):
    weather = "held_gaussian acceleration_sd=0.5 acceleration_clip=1.5 hold=2\n" if disturbance != "none" else ""
    result = flown("hover", duration=5.0, scenario=events(tmp_path, f"{weather}freeze start=4.5 end=5.5"))
    frozen = result.topics["truth"][2250]
    assert np.linalg.norm(frozen["omega_b"]) < 0.1
    assert result.guard.endswith("no good state")
    since = int(result.guard.split("step ")[1].split(":")[0])
    assert 2250 + 50 <= since <= 2250 + 75


def test_a_hover_that_comes_to_rest_to_the_last_bit_is_no_frozen_one():
    result = flown("hover", "simulator.disturbance=none", duration=13.0)
    state = result.topics["state"]
    repeats = state["p_w"][1:] == state["p_w"][:-1]
    assert repeats.all(axis=1).sum() > 500  # 1 s of the flight
    assert (result.outcome, result.guard) == ("ended", "")
