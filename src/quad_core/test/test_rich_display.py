"""A flight shows its path to scale, and text of others as text."""

import re

import numpy as np
import pytest

from quad_core.rich_display import flight_html

pytestmark = pytest.mark.unit


def test_paths_are_to_scale_and_numbers_that_are_not_finite_left_out():
    corner = np.array([[0.0, 0.0, 1.0], [np.nan, 0.0, 0.0], [10.0, 0.0, 1.0], [10.0, 5.0, 3.0]])
    lines = re.findall(r'points="([^"]*)"', flight_html({}, corner, np.zeros((0, 3))))
    points = np.array([[pair.split(",") for pair in line.split()] for line in lines if line], dtype=float)
    above, side = points
    assert (above[1] - above[0]).tolist() == [260.0, 0.0]
    assert (above[2] - above[1]).tolist() == [0.0, -130.0], "y is up"
    assert (side[2] - side[1]).tolist() == [0.0, -52.0]


def test_text_stays_text_and_no_path_is_no_picture():
    evil = "<script>alert(1)</script>"
    html = flight_html({evil: evil}, np.zeros((0, 3)), np.zeros((0, 3)))
    assert "<script" not in html
    assert "<svg" not in html
