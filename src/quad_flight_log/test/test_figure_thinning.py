"""A thinned line still shows what the full one does."""

import numpy as np
import pytest

from quad_flight_log.report.figures import Line, Panel, bounds, height, thin, thinned

COUNT = 45_000


def test_short_lines_are_left_alone():
    assert thinned((np.arange(10.0), np.ones(10)), 100).tolist() == list(range(10))


@pytest.mark.parametrize("spike", [0, 1, 777, 22_222, COUNT - 2, COUNT - 1])
def test_one_sample_spikes_survive(spike):
    times = np.arange(COUNT) * 0.002
    values = np.sin(times)
    values[spike] = 50.0
    drawn = thinned((times, values), 2000)
    assert spike in drawn
    assert drawn[0] == 0
    assert drawn[-1] == COUNT - 1
    assert len(drawn) <= 2002
    assert (np.diff(drawn) > 0).all()


def test_extremes_of_every_stretch_survive():
    rng = np.random.default_rng(3)
    values = rng.normal(size=COUNT).cumsum()
    drawn = thinned((np.arange(COUNT) * 1.0, values), 1000)
    width = COUNT // 500
    for low in range(0, COUNT - 2 * width, 997):
        stretch = slice(low, low + 2 * width)
        inside = values[drawn[(drawn >= low) & (drawn < low + 2 * width)]]
        bucket = slice(-(-low // width) * width, -(-low // width) * width + width)
        assert inside.max() >= values[bucket].max() - 1e-12
        assert inside.min() <= values[bucket].min() + 1e-12
        assert len(values[stretch]) > len(inside)


def test_paths_keep_the_extremes_of_each_coordinate():
    angle = np.linspace(0.0, 40.0, COUNT)
    path = (10.0 * np.cos(angle), 10.0 * np.sin(angle), 0.5 * angle)
    drawn = thinned(path, 3000)
    assert len(drawn) <= 3002
    for coordinate in path:
        assert coordinate[drawn].max() == coordinate.max()
        assert coordinate[drawn].min() == coordinate.min()
    points = np.stack([coordinate[drawn] for coordinate in path], axis=1)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() < 40.0 * 10.02 / 750  # m of path in one of 750 buckets


def test_a_ramp_needs_few_points_but_is_kept_evenly():
    times = np.arange(COUNT) * 0.002
    drawn = thinned((times, 2.0 * times), 1000)
    assert len(drawn) <= 1002
    assert np.diff(drawn).max() <= 2 * COUNT // 500


def test_numbers_that_are_not_finite_are_left_out():
    line = Line("a", "a", (np.arange(5.0), np.array([0.0, np.nan, 2.0, np.inf, 4.0])))
    assert [column.tolist() for column in thin(line).columns] == [[0.0, 2.0, 4.0], [0.0, 2.0, 4.0]]
    empty = thin(Line("a", "a", (np.arange(2.0), np.full(2, np.nan))))
    assert [len(column) for column in empty.columns] == [0, 0]


def test_height_sees_only_the_span():
    line = Line("a", "a", (np.array([-1.0, 0.0, 1.0, 2.0]), np.array([90.0, 1.0, 3.0, -70.0])))
    low, high = height(Panel("", (line,)), (0.0, 1.0))
    assert (low, high) == (pytest.approx(0.88), pytest.approx(3.12))
    assert height(Panel("", (line,)), (5.0, 6.0)) is None


def test_bounds_hold_all_paths_and_are_never_thin():
    rising = Line("a", "a", (np.zeros(5), np.full(5, 2.0), np.arange(5.0)))
    aside = Line("b", "b", (np.array([0.0, 0.6]), np.array([2.0, 2.0]), np.array([-2.0, 0.0])))
    spans = bounds(Panel("m", (rising, aside)))
    assert spans[2] == (pytest.approx(1.0 - 3.18), pytest.approx(1.0 + 3.18))
    assert spans[0] == (pytest.approx(0.3 - 1.0), pytest.approx(0.3 + 1.0))
    assert spans[1] == (pytest.approx(1.0), pytest.approx(3.0))
    assert bounds(Panel("m", ())) == [(0.0, 1.0)] * 3
