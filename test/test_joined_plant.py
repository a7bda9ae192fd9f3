"""Our plant under a fake PX4 that our laws fly by torque: whoever is late, nobody flies on without him."""

import signal
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from px4_flights import HERE, JoinedFlight, environment
from vehicle_packages import vehicle_packages

from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight

PATIENT = ["-p", "input_timeout:=60.0"]
CONTROLLERS = {"position_controller": PATIENT, "attitude_controller": PATIENT}
HOVER = {"trajectory": ["-p", "trajectory:=hover", "-p", "hover.duration:=2.0"], **CONTROLLERS}


@pytest.fixture(scope="module")
def given():
    found = environment()
    return {**found, "PYTHONPATH": f"{found['PYTHONPATH']}:{vehicle_packages()}"}


def flying(folder, given, options, nodes, *owner, pause=0.0):
    """Return a flight whose nodes all run; ``pause``: s of wall time that the attitude controller takes more."""
    roles = ["-p", "flight.roles:=" + ",".join(["simulator", *nodes])]
    flight = JoinedFlight(folder, given, options, *roles, *owner)
    for role, words in nodes.items():
        period = ["-p", "period_steps:=2"] if role != "recorder" else ["-p", f"directory:={folder / 'bag'}"]
        if pause and role == "attitude_controller":
            flight.replaced(role, [sys.executable, HERE / "slow_controller.py", str(pause)], *roles, *period, *words)
        else:
            flight.node(role, *roles, *period, *words)
    return flight


def cause(ended):
    """Return why the flight failed, as its owner said it."""
    return next(line for line in ended.output.splitlines() if "flight_failed" in line)


@pytest.fixture(scope="module")
def hovers(given, tmp_path_factory):
    """Return how a flight with a fast and one with a slow controller ended, and their folders."""
    top = tmp_path_factory.mktemp("hovers")

    def fly(pause):
        with flying(top / f"{pause:g}", given, {}, {**HOVER, "recorder": []}, pause=pause) as flight:
            return flight.end()

    with ThreadPoolExecutor(2) as pool:
        fast, slow = pool.map(fly, (0.0, 0.05))
    return {"fast": (fast, top / "0"), "slow": (slow, top / "0.05")}


@pytest.mark.parametrize("name", ["fast", "slow"])
def test_it_arms_hovers_and_lands_and_nothing_flies_on_without_a_wrench(hovers, name):
    ended, folder = hovers[name]
    assert ended.code == 0, ended.output
    assert ended.report["wrong"] == []
    assert ended.report["events"][-1][1] == "disarmed"
    assert len(ended.report["lags"]) > 200
    assert max(ended.report["lags"]) < 0.05  # by PX4's clock a slow wrench is no late one
    beats = np.array(ended.report["heartbeats"])
    asked = ended.report["events"][0][0]  # for offboard: before that the nodes start, and PX4 counts beats anew
    assert np.diff(beats[beats > asked - 0.1]).max() < 0.1
    bag = open_flight(folder / "bag")
    state, truth = (bag.array(topic) for topic in ("state", "truth"))
    both, at, of = np.intersect1d(state["step"], truth["step"], return_indices=True)
    assert len(both) == len(state) > 200
    off = state["p_w"][at] - truth["p_w"][of]
    assert np.abs(off - [0.0, 0.0, -0.1]).max() < 0.05  # home is where it stands, coordinates are coarse
    assert len(bag.array("actuation")) > 0.9 * len(truth)
    assert bag.metadata["outcome"] == "ended"
    assert {name: value for name, value in bag.metadata.items() if name.startswith("missing.")} == {}


def test_a_controller_that_takes_50_ms_flies_as_a_fast_one(hovers):
    tracks = []
    for ended, _ in hovers.values():
        poses = np.array(ended.report["poses"])
        begun = min(row[0] for row in ended.report["wrenches"] if row[1] > 1.0)
        tracks.append(poses[poses[:, 0] >= begun])
    length = min(map(len, tracks))
    assert length > 200
    fast, slow = (track[:length, 1:] for track in tracks)
    assert np.abs(fast - slow).max() < 0.05


def test_a_dead_controller_ends_in_a_landing_with_its_topic_named(given, tmp_path):
    long = {**HOVER, "trajectory": ["-p", "trajectory:=hover", "-p", "hover.duration:=600.0"]}
    with flying(tmp_path / "flight", given, {}, long, "-p", "gate.answer_timeout:=1.0") as flight:
        flight.wait_for("]: flying")
        flight.processes[-1].send_signal(signal.SIGKILL)
        ended = flight.end()
    assert ended.code == 1
    assert "no wrench_setpoint for 1 s, for which the plant waited" in cause(ended)
    assert ended.report["events"][-1][1] == "disarmed"
    assert "offboard lost" not in str(ended.report["events"])


@pytest.mark.parametrize(
    ("options", "owner", "words"),
    [
        ({"state_stops": 2.0}, ["-p", "gate.overdue:=0.2"], "state: nothing good from PX4"),
        ({"alien_clock": True}, [], "expected UXRCE_DDS_SYNCT 0"),
        ({"leave_at": 1500}, [], "PX4 closed the connection to its simulator"),
        ({"bad_preflight": True}, ["-p", "flight.start_timeout:=8.0"], "pre-flight checks (local_position_invalid"),
    ],
)
def test_what_ends_a_flight_is_said(given, tmp_path, options, owner, words):
    with flying(tmp_path / "flight", given, options, HOVER, *owner) as flight:
        ended = flight.end()
    assert ended.code == 1, ended.output
    assert words in cause(ended)
    assert ("state_overdue" in ended.output) == ("state_stops" in options)
