"""Messages that a bag lacks: counted by hand beside it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quad_flight_log.analysis.arrays import missing_messages
from quad_flight_log.analysis.metrics import flight_metrics

PERIOD = 2_000_000


def table(steps):
    return np.array([(step * PERIOD,) for step in steps], dtype=[("stamp_ns", np.int64)])


def test_a_whole_flight_lacks_nothing():
    tables = {"state": table(range(500)), "actuation": table(range(499)), "reference": table(range(0, 500, 5))}
    assert set(missing_messages(tables).values()) == {0}


@given(st.sets(st.integers(1, 198), max_size=60))
def test_every_message_taken_out_is_counted_once(gone):
    left = [step for step in range(200) if step not in gone]
    found = missing_messages({"state": table(left), "truth": table(range(200))})
    assert found == {"state": len(gone), "truth": 0}


@pytest.mark.parametrize(("steps", "missing"), [(range(50, 300), 49), (range(250), 49), ([7, 8], 0)])
def test_a_topic_that_comes_late_or_ends_early(steps, missing):
    assert missing_messages({"state": table(range(300)), "truth": table(steps)})["truth"] == missing


def test_a_slow_topic_that_follows_a_late_plant_lacks_nothing():
    assert missing_messages({"reference": table([0, 5, 10, 16, 21, 27, 32]), "state": table(range(37))}) == {
        "reference": 0,
        "state": 0,
    }


def test_the_metric_is_that_of_the_topic_that_lacks_most():
    kind = [("stamp_ns", np.int64), ("trajectory_time", float), ("p_w", float, (3,)), ("yaw", float)]
    reference = np.zeros(100, kind)
    reference["stamp_ns"] = np.arange(0, 500, 5) * PERIOD
    wrench = table([step for step in range(500) if step % 7])
    actuation = table(range(496))
    assert flight_metrics({"reference": reference}).missing_steps == 0.0
    found = missing_messages({"reference": reference, "wrench_setpoint": wrench, "actuation": actuation})
    assert found == {"reference": 0, "wrench_setpoint": 71, "actuation": 3}
