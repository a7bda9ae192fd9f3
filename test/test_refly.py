"""A flight of a campaign, flown again over ROS by its number, is the flight that the batch flew."""

import subprocess
import sys

import numpy as np
import pytest
from flying import LONGEST

from quad_campaign.batch import flight_of, prepared
from quad_campaign.definition import read_definition
from quad_flight.flight import fly
from quad_flight_log.bag.reader import open_flight

pytestmark = pytest.mark.flight

FILE = """
flight: {{case: hover, duration: 0.2, position: {position}, attitude: {attitude}}}
success: {{rmse: 0.5}}
seed: 5
vary:
  simulator.rigid_body.mass_error: {{uniform: [-0.05, 0.05]}}
  simulator.sensor.delay: {{uniform: [0.004, 0.02]}}
  simulator.sensor.position_noise: {{uniform: [0.001, 0.01]}}
"""


@pytest.mark.parametrize(
    ("position", "attitude"),
    [
        ("aibs", "abfnitsm"),
        ("ibs", "itsm"),
        ("pid", "pid"),
        ("se3", "se3"),
        ("aibs", "indi"),
    ],
)
def test_a_flight_of_a_campaign_flies_again_over_ros(tmp_path, position, attitude):
    path = tmp_path / "small.yaml"
    path.write_text(FILE.format(position=position, attitude=attitude), encoding="utf-8")
    words = [sys.executable, "-m", "quad_campaign.campaign_cli", str(path), "--refly", "7", "--out", tmp_path / "bag"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=LONGEST, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    batch = fly(flight_of(prepared(read_definition(path)), 7)[0])
    bag = open_flight(tmp_path / "bag")
    for topic in ("truth", "state", "reference", "wrench_setpoint"):
        ours, theirs = batch.topics[topic], bag.array(topic)
        assert len(ours) == len(theirs) > 100
    for topic, field in (("truth", "p_w"), ("state", "p_w"), ("truth", "omega_b"), ("reference", "p_w")):
        assert np.array_equal(batch.topics[topic][field], bag.array(topic)[field])
