"""Angles, alignment and gaps, against scipy, differences and hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metric_tables import table
from scipy.spatial.transform import Rotation

from quad_analysis import arrays
from quad_analysis.arrays import missing_messages

PERIOD = 2_000_000


def test_angles_agree_with_scipy():
    rng = np.random.default_rng(4)
    angles = rng.uniform([-3.0, -1.4, -3.0], [3.0, 1.4, 3.0], size=(200, 3))
    rotations = Rotation.from_euler("ZYX", angles[:, ::-1])
    np.testing.assert_allclose(arrays.euler_angles(rotations.as_quat()), angles, atol=1e-9)


def test_wrapping_keeps_plus_pi():
    found = arrays.wrapped(np.array([math.pi, -math.pi, 3 * math.pi, 0.5, 2 * math.pi + 0.5]))
    np.testing.assert_allclose(found, [math.pi, math.pi, math.pi, 0.5, 0.5], atol=1e-12)


def test_alignment_takes_equal_stamps_only_and_the_first_of_repeats():
    rows = arrays.by_stamp(table([30, 10, 10, 20], value=[3.0, 1.0, 9.0, 2.0]))
    assert rows["value"].tolist() == [1.0, 2.0, 3.0]
    left, right = arrays.matched(rows, table([5, 7, 20, 30], value=[5.0, 6.0, 7.0, 8.0]))
    assert (left["value"].tolist(), right["value"].tolist()) == ([2.0, 3.0], [7.0, 8.0])


def at(steps):
    return table([step * PERIOD for step in steps])


def test_a_whole_flight_lacks_nothing():
    tables = {"state": at(range(500)), "actuation": at(range(499)), "reference": at(range(0, 500, 5))}
    assert set(missing_messages(tables).values()) == {0}


@given(st.sets(st.integers(1, 198), max_size=60))
def test_every_message_taken_out_is_counted_once(gone):
    left = [step for step in range(200) if step not in gone]
    found = missing_messages({"state": at(left), "truth": at(range(200))})
    assert found == {"state": len(gone), "truth": 0}


@pytest.mark.parametrize(("steps", "missing"), [(range(50, 300), 49), (range(250), 49), ([7, 8], 0)])
def test_a_topic_that_comes_late_or_ends_early(steps, missing):
    assert missing_messages({"state": at(range(300)), "truth": at(steps)})["truth"] == missing


def test_a_slow_topic_that_follows_a_late_plant_lacks_nothing():
    assert missing_messages({"reference": at([0, 5, 10, 16, 21, 27, 32]), "state": at(range(37))}) == {
        "reference": 0,
        "state": 0,
    }
