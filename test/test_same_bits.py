"""A flight is decided by its parameters and its seed: not by ROS, the engine, the load, or what flies beside it."""

import subprocess
import sys

import numpy as np
import pytest
from flying import LONGEST, busy_loops, finish, flown, fly, start

from quad_analysis.replay import replay
from quad_campaign.batch import flight_of, prepared
from quad_campaign.definition import read_definition
from quad_flight import flight as without_ros
from quad_flight_log.payload_hash import STEP_TOPICS
from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight

HOVER = ("hover", "--duration", "1", "--seed", "11")
CONTROLLERS = ("position_controller", "attitude_controller")
LATE = (
    "simulator.sensor.delay=0.01",
    *(f"{role}.prediction.enabled=true" for role in CONTROLLERS),
    *(f"{role}.prediction.{channel}_age=0.01" for role in CONTROLLERS for channel in ("position", "attitude", "rate")),
    "position_controller.prediction.smoothing=20.0",
)
TROUBLE = """\
# Trouble for a short hover.
/**/simulator:
  ros__parameters:
    disturbance: timeline
    timeline:
      events: |
        # what comes
        push start=0.4 end=0.5 force=1,0,0
        payload start=0.6 mass=0.05
        rotor start=0.8 number=2 effectiveness=0.999
        link start=0.3 end=1.5 delay=0.002 jitter=0.004 drop=0.05
        freeze start=1.0 end=1.02
        gust start=0.2 end=1.2 velocity=2,1,0
"""
LOST_LINK = """/**/simulator:
  ros__parameters:
    disturbance: timeline
    timeline:
      events: |
        wind velocity=1,0,0
        link start=3 end=3.3 drop=1
"""


def words_of(case, settings=(), **choices):
    """Return the words of ``scripts/fly`` for a flight of ``from_names``."""
    words = [word for name, value in choices.items() for word in (f"--{name}", str(value))]
    return [case, *words, *(word for setting in settings for word in ("--set", setting))]


def columns_of(bag, topic):
    """Return {name: rows} of a topic of a bag, a wrench with the names and signs that it has without ROS."""
    rows = bag.array(topic)
    if "wrench" not in rows.dtype.names:
        return {name: rows[name] for name in rows.dtype.names if name not in ("log_ns", "stamp")}
    force, torque = rows["wrench"]["force"], rows["wrench"]["torque"]
    assert not force["x"].any()
    assert not force["y"].any()
    torques = np.stack([torque[axis] for axis in "xyz"], axis=-1)
    return {"stamp_ns": rows["stamp_ns"], "thrust": force["z"], "torque_b": torques}


def bits(values):
    """Return the bytes of ``values``, so that -0.0 is not 0.0 and NaN is NaN."""
    kind = np.float64 if values.dtype.kind == "f" else np.int64
    return np.ascontiguousarray(values, dtype=kind).tobytes()


def assert_same(bag, result):
    assert set(result.topics) == set(STEP_TOPICS)
    for topic, rows in result.topics.items():
        found = columns_of(bag, topic)
        missing = {*rows.dtype.names} - {*found} - {"next_step", "step", "run"}
        # what a message has no field for, such as a prediction's, is in ``extra``: the replay compares it
        assert not missing or len(found["extra"][0]), (topic, missing)
        for name in {*rows.dtype.names} & {*found}:
            assert bits(found[name]) == bits(rows[name]), f"{topic}.{name}"


@pytest.mark.parametrize(("case", "choices", "compiled"), [
    pytest.param(
        "case1",
        {"seed": 4, "plant": "paper", "preset": "minimal", "start": "printed", "duration": 2.0},
        False,
        id="case1",
    ),
    pytest.param("case2", {"seed": 3, "settings": LATE}, True, id="case2, predicted, compiled"),
    pytest.param("hover", {"seed": 5, "plant": "mujoco"}, False, id="hover, MuJoCo"),
    pytest.param("flight", {"seed": 3, "vehicle": "x500", "preset": "x500"}, False, id="outdoor"),
])  # fmt: skip
def test_ros_flight_has_the_bits_of_the_flight_without_ros_and_replays(tmp_path, case, choices, compiled):
    choices = {"duration": 1.0, **choices}
    bag = flown(*words_of(case, **choices), "--limits", "position_max=15", "--out", tmp_path / "bag")
    planned = without_ros.from_names(case, **choices)
    result = without_ros.fly(planned)
    assert result.outcome == "ended"
    assert_same(bag, result)
    if compiled:
        assert_same(bag, without_ros.fly(planned, compiled=True))
    for role in CONTROLLERS:
        again = replay(bag, role)
        assert again.equal, again.differences()
    if "settings" in choices:
        assert np.median(again.recorded["attitude_controller/internals prediction_ages.x"]) == pytest.approx(0.01)


def test_a_scenario_of_one_s_own_acts_and_is_reported(tmp_path):
    file = tmp_path / "trouble.yaml"
    file.write_text(TROUBLE)
    choices = {"scenario": file, "duration": 0.1}
    bag = flown(*words_of("hover", **choices), "--out", tmp_path / "bag", "--limits", "position_max=5")
    assert_same(bag, without_ros.fly(without_ros.from_names("hover", scenario=str(file), duration=0.1)))
    acting = bag.array("disturbance")
    assert (acting["payload_mass"] > 0.0).sum() == len(acting) - 300
    assert (acting["force_w"][:, 0] == 1.0).sum() == 50
    assert acting["sensor_frozen"].sum() == 10
    assert acting["link_lost"].any()
    reported = bag.array("flight/events")
    when = dict(zip(reported["text"].tolist(), reported["stamp_ns"] // 2_000_000, strict=True))
    assert when["begins: push start=0.4 end=0.5 force=1,0,0"] == 200
    assert when["ends: push start=0.4 end=0.5 force=1,0,0"] == 250
    assert when["begins: payload start=0.6 mass=0.05"] == 300
    state = bag.array("state")["p_w"]
    assert (state[500:510] == state[500]).all()


def test_a_flight_that_the_guard_takes_over_has_the_same_bits_everywhere(tmp_path):
    scenario = tmp_path / "lost_link.yaml"
    scenario.write_text(LOST_LINK, encoding="utf-8")
    done = fly("hover", "--duration", "8", "--scenario", scenario, "--out", tmp_path / "bag")
    assert done.returncode == 1, done.stdout + done.stderr
    bag = open_flight(tmp_path / "bag")
    # the last wrench is that of step 1499; 50 ms are 25 steps
    assert "guard in descend since step 1525: no good wrench; down at step" in bag.metadata["reason"]
    request = without_ros.from_names("hover", duration=8.0, scenario=str(scenario))
    plain, compiled = (without_ros.fly(request, compiled=compiled) for compiled in (False, True))
    assert (plain.outcome, compiled.outcome) == ("taken over", "taken over")
    assert plain.guard == "guard in descend since step 1525: no good wrench"
    assert_same(bag, plain)
    assert_same(bag, compiled)
    last = plain.topics["truth"][-1]
    assert -0.01 < last["p_w"][2] < 0.05
    assert np.linalg.norm(last["v_w"]) < 1.5


CAMPAIGN = """
flight: {{case: hover, duration: 0.2, position: {position}, attitude: {attitude}}}
success: {{rmse: 0.5}}
seed: 5
vary:
  simulator.rigid_body.mass_error: {{uniform: [-0.05, 0.05]}}
  simulator.sensor.delay: {{uniform: [0.004, 0.02]}}
  simulator.sensor.position_noise: {{uniform: [0.001, 0.01]}}
"""


@pytest.mark.parametrize(("position", "attitude"), [("ibs", "itsm"), ("indi", "indi"), ("l1", "geometric_pid")])
def test_a_flight_of_a_campaign_flies_again_over_ros(tmp_path, position, attitude):
    path = tmp_path / "small.yaml"
    path.write_text(CAMPAIGN.format(position=position, attitude=attitude), encoding="utf-8")
    words = [sys.executable, "-m", "quad_campaign.campaign_cli", str(path), "--refly", "7", "--out", tmp_path / "bag"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=LONGEST, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    batch = without_ros.fly(flight_of(prepared(read_definition(path)), 7)[0])
    assert_same(open_flight(tmp_path / "bag"), batch)


@pytest.fixture(scope="module")
def without():
    """The flight ``HOVER`` without ROS."""
    return without_ros.fly(without_ros.from_names("hover", duration=1.0, seed=11))


def test_two_busy_loops_change_nothing(tmp_path, without):
    with busy_loops(2):
        assert_same(flown(*HOVER, "--out", tmp_path / "bag"), without)


def test_one_process_for_all_nodes_changes_nothing(tmp_path, without):
    assert_same(flown(*HOVER, "--one-process", "--out", tmp_path / "bag"), without)


def test_two_namespaces_in_one_domain_are_two_lone_flights_and_share_no_topic(tmp_path, without):
    names = ("uav1", "uav2")
    flights = [start(*HOVER, "--namespace", name, "--domain", "157", "--out", tmp_path / name) for name in names]
    for done in [finish(flight) for flight in flights]:
        assert done.returncode == 0, done.stdout + done.stderr
    for name in names:
        flight = open_flight(tmp_path / name, namespace=name)
        assert_same(flight, without)
        # every fifth step of 2 ms, in order, and none of the other vehicle's
        clock = flight.array("clock")["clock"]
        assert (clock["sec"] * 1e9 + clock["nanosec"]).tolist() == [10_000_000 * k for k in range(len(clock))]
        # one for all is /tf: its frames carry the namespace
        assert {topic for topic in flight.topics if not topic.startswith(f"/{name}/")} <= {"/tf"}
        told = [status for row in flight.array("diagnostics") for status in row["status"]]
        assert told
        assert all(status["hardware_id"].startswith(f"/{name}/") for status in told)
