"""The paper's figures 5 to 18 hold the quantities that the paper plots; modes and takeovers shade them."""

from dataclasses import replace
from itertools import pairwise

import drawn_flights
import numpy as np
import pytest
from drawn_flights import APPROACH, OFFSET, YAW_ERROR
from metric_tables import seconds, table

from quad_analysis.tables import Takeover
from quad_report.figures import REFERENCE, Figure, Line, Panel, colours, drawn, runs_of
from quad_report.flight_figures import (
    Run,
    inside_figures,
    mode_bands,
    paper_figures,
    playback,
    run_from_tables,
    samples,
    scene,
    with_bands,
)


@pytest.fixture(scope="module")
def two():
    return [drawn_flights.run("proposed"), drawn_flights.run("pid", scale=2.0)]


@pytest.mark.parametrize(("trajectory", "first"), [("case1", 5), ("case2", 12)])
def test_each_case_has_its_seven_figures(trajectory, first):
    runs = [drawn_flights.run("a", trajectory)]
    figures = [*playback(runs), *paper_figures(runs)]
    subjects = ["3-D", "Longitudinal", "Lateral", "Vertical", "Roll", "Pitch", "Yaw"]
    assert len(figures) == 7
    for offset, (figure, subject) in enumerate(zip(figures, subjects, strict=True)):
        assert figure.title.startswith(f"Figure {first + offset}. {subject}")
    assert len({figure.key for figure in figures}) == 7


def test_another_trajectory_has_no_figure_numbers():
    figures = paper_figures([drawn_flights.run("a", "hover")])
    assert figures[0].title == "Longitudinal translational motion tracking"
    assert all(figure.key.startswith("hover-") for figure in figures)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_position_above_error_below(two, axis):
    figure = paper_figures(two)[axis]
    above, below = figure.panels
    assert {line.run for line in above.lines} == {"proposed", "pid", REFERENCE}
    errors = {line.run: line.columns for line in below.lines}
    np.testing.assert_allclose(errors["proposed"][1], OFFSET[axis], atol=1e-12)
    np.testing.assert_allclose(errors["pid"][1], 2.0 * OFFSET[axis], atol=1e-12)
    assert errors["pid"][0][0] == pytest.approx(-APPROACH)
    assert figure.span == (0.0, 4.0)


def test_attitude_error_is_flown_minus_wanted(two):
    yaw = paper_figures(two)[5]
    above, below = yaw.panels
    assert [line.dashed for line in above.lines] == [False, True, False, True]
    assert above.lines[1].run == "proposed"
    np.testing.assert_allclose(above.lines[0].columns[1], 0.4 + YAW_ERROR, atol=1e-12)
    np.testing.assert_allclose(below.lines[0].columns[1], YAW_ERROR, atol=1e-12)


def test_yaw_beyond_half_a_turn_is_drawn_without_a_jump():
    tables = drawn_flights.tables()
    angle = np.linspace(3.0, 3.4, 600)
    tables["truth"]["q_wb"] = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)
    tables["attitude_setpoint"]["angles"][:, 2] = np.where(angle > np.pi, angle - 2 * np.pi, angle)
    above, below = paper_figures([run_from_tables("a", "case1", tables)])[5].panels
    for line in above.lines:
        np.testing.assert_allclose(line.columns[1], angle, atol=1e-9)
    np.testing.assert_allclose(below.lines[0].columns[1], 0.0, atol=1e-9)


def test_different_references_are_both_drawn():
    tables = drawn_flights.tables()
    tables["reference"]["p_w"] = tables["reference"]["p_w"] + 1.0
    runs = [drawn_flights.run("a"), run_from_tables("b", "case1", tables)]
    figures = paper_figures(runs)
    assert [line.label for line in figures[0].panels[0].lines] == ["a", "b", "a: reference", "b: reference"]
    assert [each["ownReference"] for each in scene(runs, colours(["a", "b"]))["flights"]] == [False, True]
    assert runs_of(figures) == ["a", "b"]


def test_missing_topics_leave_lines_out():
    truth_only = {topic: table for topic, table in drawn_flights.tables().items() if topic == "truth"}
    run = run_from_tables("a", "", truth_only)
    figures = paper_figures([run])
    assert [len(panel.lines) for panel in figures[0].panels] == [1], "no panel without a line"
    assert figures[0].panels[0].lines[0].columns[0][0] == 0.0
    assert inside_figures([run]) == []
    assert paper_figures([run_from_tables("a", "", {})]) == []


def test_insides(two):
    figures = {figure.key: figure for figure in inside_figures(two)}
    distance = {line.run: line.columns[1] for line in figures["case1-error"].panels[0].lines}
    np.testing.assert_allclose(distance["pid"], 2.0 * np.sqrt(0.09 + 0.04 + 0.01), atol=1e-12)
    thrust = {line.label: line.columns[1][0] for line in figures["case1-thrust"].panels[0].lines}
    assert thrust["pid: commanded"] == 5.5
    assert thrust["pid: achieved"] == 5.25
    torques = [panel.lines[1].columns[1][0] for panel in figures["case1-torque"].panels]
    assert torques == [pytest.approx(0.02), 0.0, 0.0]
    gains = [panel.lines[1].columns[1][0] for panel in figures["case1-adaptive-gains"].panels]
    assert gains == [7.0, 5.0, 5.0]
    wind = {line.label: (line.columns[1][0], line.dashed) for line in figures["case1-disturbance"].panels[2].lines}
    assert wind["proposed: true"] == (0.5, True)
    assert wind["proposed"] == (0.4, False)
    assert "case1-sliding" in figures
    assert "case1-adaptive-constants" not in figures
    effort = [panel.lines[1].columns[1][-1] for panel in figures["case1-effort"].panels]
    points = drawn_flights.circle(600)[200:]  # from t = 0 on, the torque is 0.01 times them
    assert effort == pytest.approx([400 * 0.01 * 5.5**2, 0.01 * (0.01 * points**2 * 0.01).sum()])


def test_a_law_that_lacks_a_quantity_has_no_curve_at_zero():
    tables = drawn_flights.tables()
    tables["position_controller/internals"]["adaptive_gain"] = 0.0
    tables["attitude_controller/internals"]["sliding_variable"][:, 1:] = 0.0
    alone = {figure.key for figure in inside_figures([run_from_tables("pid", "case1", tables)])}
    assert "case1-adaptive-gains" not in alone
    both = inside_figures([drawn_flights.run("a"), run_from_tables("pid", "case1", tables)])
    gains = next(figure for figure in both if figure.key == "case1-adaptive-gains")
    assert [[line.run for line in panel.lines] for panel in gains.panels] == [["a"]] * 3


def test_a_spectrum_has_its_peak_where_the_torque_swings():
    tables = drawn_flights.tables(steps=1400)
    tables["wrench_setpoint"]["torque_b"] = np.sin(2.0 * np.pi * 5.0 * np.arange(1400) * 0.01)[:, None]
    figure = next(f for f in inside_figures([run_from_tables("a", "case1", tables)]) if f.key == "case1-spectrum")
    frequency, power = figure.panels[0].lines[0].columns
    assert frequency[power.argmax()] == pytest.approx(5.0)
    assert (power @ np.full(len(power), frequency[1] - frequency[0])) == pytest.approx(0.5, rel=0.01)


def test_the_viewer_has_place_attitude_thrust_reference_and_wind_where_recorded():
    run = drawn_flights.run("a", steps=600)
    found = samples(run, count=100)
    assert {name: len(values) for name, values in found.items()} == dict.fromkeys("tpq", 100) | {
        "thrust": 100, "reference": 100,
    }  # fmt: skip
    np.testing.assert_allclose(found["p"] - found["reference"], np.broadcast_to(OFFSET, (100, 3)), atol=1e-12)
    assert (found["t"][0], found["t"][-1]) == (pytest.approx(-APPROACH), pytest.approx(3.99))
    assert (found["thrust"] == 5.25).all()
    tables = drawn_flights.tables()
    windy = table(tables["disturbance"]["stamp_ns"], wind_w=np.tile([1.0, 2.0, 3.0], (600, 1)))
    assert (samples(run_from_tables("a", "case1", {**tables, "disturbance": windy}), 9)["wind"] == [1, 2, 3]).all()
    tables["reference"]["stamp_ns"] += 3_000_000_000
    late = samples(run_from_tables("a", "case1", tables))
    assert np.isnan(late["reference"][:300]).all()
    assert np.isfinite(late["reference"][300:]).all()
    tables["reference"]["stamp_ns"] -= 4_000_000_000
    assert np.isnan(samples(run_from_tables("a", "case1", tables))["reference"][500:]).all()


MODES = np.array([0, 1, 2, 2, 4, 3, 3, 5, 0], dtype=np.uint8)
NAMES = np.array(
    ["DISARMED", "ARMING", "TAKEOFF", "TAKEOFF", "HOLD", "MISSION", "MISSION", "LAND", "DISARMED"], dtype=object
)
FLOWN = {"flight/mode": table(seconds(*range(9)), mode=MODES, name=NAMES)}
TIMES = np.linspace(0.0, 8.0, 9)
HEIGHT = Figure("height", "Height", "", (Panel("z [m]", (Line("a", "a", (TIMES, TIMES)),)),))


def test_each_mode_in_the_air_is_a_band_from_its_entry_to_the_next():
    bands = mode_bands(Run("a", "hover", FLOWN))
    assert [(band.begin, band.end, band.label) for band in bands] == [
        (2.0, 4.0, "TAKEOFF"),
        (4.0, 5.0, "HOLD"),
        (5.0, 7.0, "MISSION"),
        (7.0, 8.0, "LAND"),
    ]
    assert all(one.opacity != other.opacity for one, other in pairwise(bands))


def test_a_flight_without_a_commander_has_none():
    assert mode_bands(Run("a", "hover", {})) == ()


def test_modes_and_takeovers_shade_the_figures_of_one_flight_and_takeovers_alone_those_of_several():
    run = Run("a", "hover", FLOWN, (Takeover("descend", "no good wrench", 1500, 3_000_000_000, 4_000_000_000),))
    path = HEIGHT._replace(x_label="x [m]")
    [alone, unshaded] = with_bands([HEIGHT, path], [run])
    assert unshaded.bands == ()
    assert [band.label for band in alone.bands] == ["TAKEOFF", "HOLD", "MISSION", "LAND", "guard in descend"]
    layout = drawn(alone, colours(["a"])).to_plotly_json()["layout"]
    assert [shape["opacity"] for shape in layout["shapes"]] == [
        band.opacity for band in sorted(alone.bands, key=lambda each: each.begin)
    ]
    assert layout["annotations"][-1]["text"] == "LAND"
    [both] = with_bands([HEIGHT], [run, replace(run, name="b")])
    assert [band.label for band in both.bands] == ["a: guard in descend", "b: guard in descend"]


def test_the_time_of_a_mission_starts_with_its_trajectory():
    tables = drawn_flights.tables()
    tables["reference"]["trajectory_time"] = np.r_[np.zeros(100), np.full(450, -1e6), 0.5 + np.arange(50) * 0.01]
    run = run_from_tables("a", "case1", {**tables, "flight/mode": FLOWN["flight/mode"]})
    assert run.times("truth")[0] == pytest.approx(-5.0)  # MISSION from 5 s on, t = 0.5 at 5.5 s
    assert paper_figures([run])[0].span is None, "take-off and landing are shown"
