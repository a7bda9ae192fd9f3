"""A thinned line still shows what the full one does, and a figure is valid Plotly."""

import json

import drawn_flights
import numpy as np
import pytest

from quad_report.figures import Figure, Line, Panel, colours, drawn, height, thin
from quad_report.flight_figures import paper_figures

COUNT = 45_000


def as_json(figure, runs):
    return json.loads(drawn(figure, colours(runs)).to_json())


def trace_of(*columns):
    line = Line("a", "a", columns)
    return as_json(Figure("k", "T", "", (Panel("y", (line,)),)), ["a"])["data"][0]


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


def test_a_figure_has_one_time_axis_and_names_each_run_once():
    for figure in paper_figures([drawn_flights.run("a"), drawn_flights.run("<b>", scale=2.0)]):
        found = as_json(figure, ["a", "<b>"])
        assert {trace["meta"]["run"] for trace in found["data"]} >= {"a", "<b>"}
        named = [trace["name"] for trace in found["data"] if trace["showlegend"]]
        assert len(named) == len(set(named))
        assert "&lt;b&gt;" in named, "Plotly reads <b> as bold"
        axes = [axis for name, axis in found["layout"].items() if name.startswith("xaxis")]
        assert [axis["range"] for axis in axes] == [[0.0, 4.0]] * len(figure.panels)
        assert sum("matches" in axis for axis in axes) == len(axes) - 1


def test_numbers_come_back_and_those_that_blew_up_lie_at_the_edge_of_single_precision():
    trace = trace_of(np.arange(4.0), np.array([0.5, -1.25, 3.0, 8.0]))
    assert drawn_flights.decoded(trace["x"]).tolist() == [0.0, 1.0, 2.0, 3.0]
    assert drawn_flights.decoded(trace["y"]).tolist() == [0.5, -1.25, 3.0, 8.0]
    trace = trace_of(np.arange(3.0), np.array([0.0, 1e300, -1e300]))
    np.testing.assert_allclose(drawn_flights.decoded(trace["y"]), [0.0, 3.4028235e38, -3.4028235e38], rtol=1e-6)
