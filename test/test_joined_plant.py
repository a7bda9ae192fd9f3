"""Our plant under a fake PX4 that our laws fly by torque: whoever is late, nobody flies on without him."""

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from px4_flights import HERE, WHOLE, cause, flown, happened, killed

from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight


@pytest.fixture(scope="module")
def hovers(tmp_path_factory):
    """Return how a flight with a fast and one with a slow controller ended, and their folders."""
    top = tmp_path_factory.mktemp("hovers")
    slow = {"attitude_controller": [sys.executable, HERE / "slow_controller.py", "0.05"]}

    def fly(name, commands):
        return flown(top / name, "joined", {}, WHOLE, commands=commands, recorded=True), top / name

    with ThreadPoolExecutor(2) as pool:
        return dict(zip(("fast", "slow"), pool.map(fly, ("fast", "slow"), (None, slow)), strict=True))


@pytest.mark.parametrize("name", ["fast", "slow"])
def test_it_arms_hovers_and_lands_and_nothing_flies_on_without_a_wrench(hovers, name):
    ended, folder = hovers[name]
    assert ended.code == 0, ended.output
    assert ended.report["wrong"] == []
    assert happened(ended)[-1] == "disarmed"
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


def test_a_dead_controller_ends_in_a_landing_with_its_topic_named(tmp_path):
    quick = ("-p", "gate.answer_timeout:=1.0")
    ended = flown(
        tmp_path / "flight", "joined", {}, "takeoff:2,hold:60,land", *quick, then=killed("attitude_controller")
    )
    assert ended.code == 1
    assert "no wrench_setpoint for 1 s, for which the plant waited" in cause(ended)
    assert happened(ended)[-1] == "disarmed"
    assert "offboard lost" not in happened(ended)


@pytest.mark.parametrize(("options", "owner", "words"), [
    ({"alien_clock": True}, [], "expected UXRCE_DDS_SYNCT 0"),
    ({"leave_at": 1500}, [], "PX4 closed the connection to its simulator"),
    ({"bad_preflight": True}, ["-p", "flight.start_timeout:=8.0"], "pre-flight checks (attitude_invalid"),
])  # fmt: skip
def test_what_ends_a_flight_is_said(tmp_path, options, owner, words):
    ended = flown(tmp_path / "flight", "joined", options, WHOLE, *owner)
    assert ended.code == 1, ended.output
    assert words in cause(ended)
