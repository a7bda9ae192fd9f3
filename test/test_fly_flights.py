"""`scripts/fly` from start to end: what it prints is what the bag holds, and its exit code tells the truth."""

import math
import re

import numpy as np
import pytest
from flying import finish, fly, start

from quad_flight_log.reader import open_flight

pytestmark = pytest.mark.flight


def printed(done, metric):
    """Return the number that the table of a flight gives for ``metric``."""
    match = re.search(rf"^{metric} +(\S+)", done.stdout, re.MULTILINE)
    assert match, done.stdout
    return float(match[1])


def errors_of(bag):
    """Return the distance in m to each reference point with trajectory time >= 0, at its own stamp."""
    truth, reference = bag.array("truth"), bag.array("reference")
    flown = reference[reference["trajectory_time"] >= 0.0]
    where = dict(zip(truth["stamp_ns"].tolist(), truth["p_w"].tolist(), strict=True))
    return np.array(
        [math.dist(where[stamp], p) for stamp, p in zip(flown["stamp_ns"].tolist(), flown["p_w"].tolist(), strict=True)]
    )


def test_a_good_flight_prints_what_its_bag_holds(tmp_path):
    out = tmp_path / "bag"
    settings = ["--set", "vehicle.mass=0.6", "--set", "simulator.rigid_body.mass_error=0.01"]
    done = finish(start("hover", "--duration", "1", "--seed", "5", "--out", out, "--view", *settings))
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"^view: http://127\.0\.0\.1:\d+/ ", done.stdout, re.MULTILINE)
    assert "view: the flight ended\n" in done.stdout
    bag = open_flight(out)
    errors = errors_of(bag)
    assert len(errors) == 100
    assert printed(done, "position_rmse") == pytest.approx(np.sqrt((errors**2).mean()), rel=1e-4)
    assert printed(done, "position_max") == pytest.approx(errors.max(), rel=1e-4)
    assert printed(done, "position_final") == pytest.approx(errors[-1], rel=1e-4)
    assert re.search(r"seed 5; 4\.00 s flown at [\d.]+ x real time; ended", done.stdout), done.stdout
    assert bag.metadata["seed"] == "5"
    assert not bag.truncated
    nodes = {row["role"]: row["parameters"] for row in bag.array("flight/parameters")}
    assert len(nodes) == 5
    assert all("vehicle.mass: 0.6\n" in text for text in nodes.values())
    assert "rigid_body.mass_error: 0.01\n" in nodes["simulator"]


def test_a_diverging_flight_ends_finite_named_and_recorded(tmp_path):
    out = tmp_path / "bag"
    done = fly(
        "case1", "--preset", "printed", "--start", "printed", "--set", "vehicle.thrust_to_weight=20", "--out", out
    )
    assert done.returncode == 1, done.stdout + done.stderr
    assert re.search(r"diverged: the state left its bounds at t = \d+\.\d+ s", done.stderr), done.stderr
    bag = open_flight(out)
    assert not bag.truncated
    assert bag.metadata["outcome"] == "failed"
    assert "diverged" in bag.metadata["reason"]
    for topic in ("truth", "wrench_setpoint", "reference", "attitude_setpoint"):
        rows = bag.array(topic)
        assert len(rows) > 100
    assert np.isfinite(bag.array("truth")["p_w"]).all()
    assert np.isfinite(bag.array("wrench_setpoint")["wrench"]["force"]["z"]).all()


def test_a_flight_beyond_its_limits_fails_and_says_which(tmp_path):
    other = ("--vehicle", "x500", "--preset", "x500")
    done = finish(
        start("hover", "--duration", "0.5", "--out", tmp_path / "bag", "--limits", "position_max=1e-6", *other)
    )
    assert done.returncode == 1
    assert "hover: aibs + abfnitsm, preset x500, vehicle x500, plant rigid_body" in done.stdout
    assert "position_max: found" in done.stderr
    assert "at most 1e-06 m" in done.stderr
