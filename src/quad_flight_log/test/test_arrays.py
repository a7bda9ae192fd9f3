"""Angles and alignment, against scipy, differences and hand."""

import math

import numpy as np
from metric_tables import table
from scipy.spatial.transform import Rotation

from quad_flight_log.analysis import arrays


def test_angles_agree_with_scipy_and_rates_with_differences():
    rng = np.random.default_rng(4)
    angles = rng.uniform([-3.0, -1.4, -3.0], [3.0, 1.4, 3.0], size=(200, 3))
    rotations = Rotation.from_euler("ZYX", angles[:, ::-1])
    np.testing.assert_allclose(arrays.euler_angles(rotations.as_quat()), angles, atol=1e-9)
    omega = rng.normal(size=(200, 3))
    step = 1e-6
    later = (rotations * Rotation.from_rotvec(omega * step)).as_euler("ZYX")[:, ::-1]
    earlier = (rotations * Rotation.from_rotvec(-omega * step)).as_euler("ZYX")[:, ::-1]
    slope = arrays.wrapped(later - earlier) / (2 * step)
    np.testing.assert_allclose(arrays.euler_rates(angles, omega), slope, atol=1e-5)


def test_wrapping_keeps_plus_pi():
    found = arrays.wrapped(np.array([math.pi, -math.pi, 3 * math.pi, 0.5, 2 * math.pi + 0.5]))
    np.testing.assert_allclose(found, [math.pi, math.pi, math.pi, 0.5, 0.5], atol=1e-12)


def test_alignment_takes_equal_stamps_only_and_the_first_of_repeats():
    rows = arrays.by_stamp(table([30, 10, 10, 20], value=[3.0, 1.0, 9.0, 2.0]))
    assert rows["value"].tolist() == [1.0, 2.0, 3.0]
    match = arrays.aligned(rows["stamp_ns"], np.array([5, 20, 30, 40]))
    assert (match.stamp_ns.tolist(), match.left.tolist(), match.right.tolist()) == ([20, 30], [1, 2], [1, 2])
