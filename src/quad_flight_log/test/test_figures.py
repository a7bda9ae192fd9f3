"""A thinned line still shows what the full one does, and a figure is valid Plotly."""

import drawn_flights
import numpy as np
import pytest

from quad_flight_log.report.figures import Figure, Line, Panel, colours, height, specification, thin
from quad_flight_log.report.flight_figures import paper_figures

COUNT = 45_000


def trace_of(*columns):
    line = Line("a", "a", columns)
    return specification(Figure("k", "T", "", (Panel("y", (line,)),)), colours(["a"]))["data"][0]


@pytest.mark.parametrize("spike", [0, 1, 777, 22_222, COUNT - 2, COUNT - 1])
def test_spikes_of_one_sample_survive(spike):
    times = np.arange(COUNT) * 0.002
    values = np.sin(times)
    values[spike] = 50.0
    x, y = thin(Line("a", "a", (times, values)), 2000).columns
    assert y.max() == 50.0
    assert (x[0], x[-1]) == (times[0], times[-1])
    assert len(x) <= 2002
    assert (np.diff(x) > 0).all()


def test_paths_keep_the_extremes_of_each_coordinate():
    angle = np.linspace(0.0, 40.0, COUNT)
    path = (10.0 * np.cos(angle), 10.0 * np.sin(angle), 0.5 * angle)
    thinned = thin(Line("a", "a", path), 3000).columns
    assert len(thinned[0]) <= 3002
    for full, kept in zip(path, thinned, strict=True):
        assert (kept.max(), kept.min()) == (full.max(), full.min())
    # the path is 400.5 m long: no gap is longer than two of the 500 stretches
    assert np.linalg.norm(np.diff(np.stack(thinned), axis=1), axis=0).max() < 2 * 400.5 / 500


def test_short_lines_and_dots_are_left_alone_and_numbers_that_are_not_finite_left_out():
    line = Line("a", "a", (np.arange(5.0), np.array([0.0, np.nan, 2.0, np.inf, 4.0])))
    assert [column.tolist() for column in thin(line).columns] == [[0.0, 2.0, 4.0], [0.0, 2.0, 4.0]]
    dots = Line("a", "a", (np.arange(500.0), np.arange(500.0)), dots=True)
    assert len(thin(dots, 100).columns[0]) == 500
    empty = thin(Line("a", "a", (np.arange(2.0), np.full(2, np.nan))))
    assert [len(column) for column in empty.columns] == [0, 0]


def test_height_sees_only_the_span():
    line = Line("a", "a", (np.array([-1.0, 0.0, 1.0, 2.0]), np.array([90.0, 1.0, 3.0, -70.0])))
    low, high = height(Panel("", (line,)), (0.0, 1.0))
    assert (low, high) == (pytest.approx(0.88), pytest.approx(3.12))
    assert height(Panel("", (line,)), (5.0, 6.0)) is None


@pytest.mark.parametrize(
    ("path", "spans", "ticks"),
    [
        ((np.zeros(5), np.full(5, 2.0), np.arange(5.0)), [(-0.8, 0.8), (1.2, 2.8), (-0.4, 4.4)], [0, 1, 2, 3, 4]),
        ((), [(0, 1)] * 3, [0.2, 0.4, 0.6, 0.8]),
    ],
)
def test_axes_in_space_hold_the_path_are_never_thin_and_have_no_tick_at_their_ends(path, spans, ticks):
    lines = (Line("a", "a", path),) if path else ()
    scene = specification(Figure("k", "T", "", (Panel("m", lines),), spatial=True), colours(["a"]))["layout"]["scene"]
    for axis, expected in zip("xyz", spans, strict=True):
        assert scene[f"{axis}axis"]["range"] == pytest.approx(expected, abs=0.14)
        low, high = scene[f"{axis}axis"]["range"]
        shown = scene[f"{axis}axis"]["tickvals"]
        assert low + 0.07 * (high - low) <= min(shown) <= max(shown) <= high - 0.07 * (high - low)
    assert scene["zaxis"]["tickvals"] == pytest.approx(ticks)


def test_every_figure_is_valid_plotly():
    plotly = pytest.importorskip("plotly.graph_objects")
    for figure in paper_figures([drawn_flights.run("a"), drawn_flights.run("b", scale=2.0)]):
        found = specification(figure, colours(["a", "b"]))
        plotly.Figure(found)
        assert {trace["meta"]["run"] for trace in found["data"]} >= {"a", "b"}


def test_numbers_come_back_and_those_that_blew_up_lie_at_the_edge_of_single_precision():
    trace = trace_of(np.arange(4.0), np.array([0.5, -1.25, 3.0, 8.0]))
    assert drawn_flights.decoded(trace["x"]).tolist() == [0.0, 1.0, 2.0, 3.0]
    assert drawn_flights.decoded(trace["y"]).tolist() == [0.5, -1.25, 3.0, 8.0]
    trace = trace_of(np.arange(3.0), np.array([0.0, 1e300, -1e300]))
    np.testing.assert_allclose(drawn_flights.decoded(trace["y"]), [0.0, 3.4028235e38, -3.4028235e38], rtol=1e-6)
