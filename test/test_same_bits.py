"""A flight is decided by its parameters and its seed: not by ROS, the engine, the load, or what flies beside it."""

import signal
import time

import numpy as np
import pytest
from flying import CONFIG, busy_loops, finish, flown, fly, hash_of, start

from quad_flight import flight as without_ros
from quad_flight_log.bag.payload_hash import STEP_TOPICS, payload_hash, topic_hashes
from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight

HOVER = ("hover", "--duration", "1", "--seed", "11")


def alone(case, duration, seed, plant, preset, compiled=False):
    files = [CONFIG / "vehicles/paper.yaml", CONFIG / f"controllers/{preset}.yaml", CONFIG / f"scenarios/{case}.yaml"]
    changes = {
        "/**": {"flight.seed": seed},
        "simulator": {"plant": plant},
        "trajectory": {f"{case}.duration": duration},
    }
    return without_ros.fly(without_ros.flight_from_files(files, changes), compiled=compiled)


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
        assert not missing, (topic, missing)
        for name in {*rows.dtype.names} & {*found}:
            assert bits(found[name]) == bits(rows[name]), f"{topic}.{name}"


@pytest.mark.parametrize(
    ("case", "duration", "seed", "plant", "preset", "compiled"),
    [
        ("case2", 1.0, 3, "rigid_body", "tuned", True),
        ("case1", 1.0, 4, "paper", "minimal", False),
        ("hover", 1.0, 5, "mujoco", "tuned", False),
    ],
)
def test_ros_flight_has_the_bits_of_the_flight_without_ros(tmp_path, case, duration, seed, plant, preset, compiled):
    out = tmp_path / "bag"
    choices = (
        "--duration",
        str(duration),
        "--seed",
        str(seed),
        "--plant",
        plant,
        "--preset",
        preset,
        "--limits",
        "position_max=5",
    )
    bag = flown(case, *choices, "--out", out)
    result = alone(case, duration, seed, plant, preset)
    assert result.outcome == "ended"
    assert_same(bag, result)
    if compiled:
        assert_same(bag, alone(case, duration, seed, plant, preset, compiled=True))


LOST_LINK = """/**/simulator:
  ros__parameters:
    disturbance: timeline
    timeline:
      events: |
        wind velocity=1,0,0
        link start=3 end=3.3 drop=1
"""


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


@pytest.fixture(scope="module")
def lone_hash(tmp_path_factory):
    """The payload hash of the hover flight, alone on the machine as far as the tests know."""
    return payload_hash(flown(*HOVER, "--out", tmp_path_factory.mktemp("lone") / "bag"))


def test_another_seed_has_another_hash_and_only_where_the_disturbance_matters(tmp_path, lone_hash):
    one = flown("hover", "--duration", "1", "--seed", "12", "--out", tmp_path / "bag")
    assert payload_hash(one) != lone_hash
    again = flown(*HOVER, "--out", tmp_path / "again")
    assert payload_hash(again) == lone_hash
    hashes, others = topic_hashes(one), topic_hashes(again)
    assert hashes["reference"] == others["reference"]
    assert hashes["disturbance"] != others["disturbance"]
    assert hashes["truth"] != others["truth"]


def test_two_busy_loops_change_nothing(tmp_path, lone_hash):
    with busy_loops(2):
        bag = flown(*HOVER, "--out", tmp_path / "bag")
    assert payload_hash(bag) == lone_hash


def test_one_process_for_all_nodes_changes_nothing(tmp_path, lone_hash):
    bag = flown(*HOVER, "--one-process", "--out", tmp_path / "bag")
    assert payload_hash(bag) == lone_hash


def test_one_process_that_is_told_wrong_or_interrupted_says_so(tmp_path):
    refused = finish(start("hover", "--one-process", "--set", "simulator.window=0", "--out", tmp_path / "refused"))
    assert (refused.returncode, "window: found 0" in refused.stderr) == (2, True)
    flying = start("case2", "--one-process", "--out", tmp_path / "halted")
    deadline = time.monotonic() + 60.0
    while not flew(tmp_path / "halted") and flying.poll() is None and time.monotonic() < deadline:
        time.sleep(0.1)
    flying.send_signal(signal.SIGINT)
    halted = finish(flying)
    assert halted.returncode == 1, halted.stdout + halted.stderr
    assert "SIGINT" in halted.stderr
    bag = open_flight(tmp_path / "halted")
    assert not bag.truncated
    assert len(bag.array("truth")) > 100


def flew(directory):
    """Tell whether the bag in ``directory`` has begun to grow."""
    return any(path.stat().st_size > 200_000 for path in directory.glob("*.mcap*"))


def test_two_flights_at_once_are_two_lone_flights(tmp_path, lone_hash):
    flights = [start(*HOVER, "--out", tmp_path / name) for name in "ab"]
    for done in [finish(flight) for flight in flights]:
        assert done.returncode == 0, done.stdout + done.stderr
    assert [hash_of(tmp_path / name) for name in "ab"] == [lone_hash] * 2


def test_two_namespaces_in_one_domain_are_two_lone_flights(tmp_path, lone_hash):
    choices = {
        name: (*HOVER, "--namespace", name, "--domain", "157", "--out", tmp_path / name) for name in ("uav1", "uav2")
    }
    flights = [start(*arguments) for arguments in choices.values()]
    for done in [finish(flight) for flight in flights]:
        assert done.returncode == 0, done.stdout + done.stderr
    for name in choices:
        bag = open_flight(tmp_path / name)
        assert f"/{name}/truth" in bag.topics
        assert payload_hash(bag) == lone_hash
