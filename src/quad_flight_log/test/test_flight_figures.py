"""The paper's figures 5 to 18 hold the quantities that the paper plots; modes and takeovers shade them."""

from dataclasses import replace
from itertools import pairwise

import drawn_flights
import numpy as np
import pytest
from drawn_flights import APPROACH, OFFSET, YAW_ERROR
from metric_tables import seconds, table

from quad_flight_log.analysis.takeovers import Takeover
from quad_flight_log.report.figures import REFERENCE, Figure, Line, Panel, colours, runs_of, specification
from quad_flight_log.report.flight_figures import (
    Run,
    inside_figures,
    mode_bands,
    paper_figures,
    run_from_tables,
    with_bands,
)


@pytest.fixture(scope="module")
def two():
    return [drawn_flights.run("proposed"), drawn_flights.run("pid", scale=2.0)]


@pytest.mark.parametrize(("trajectory", "first"), [("case1", 5), ("case2", 12)])
def test_each_case_has_its_seven_figures(trajectory, first):
    figures = paper_figures([drawn_flights.run("a", trajectory)])
    subjects = ["3-D", "Longitudinal", "Lateral", "Vertical", "Roll", "Pitch", "Yaw"]
    assert len(figures) == 7
    for offset, (figure, subject) in enumerate(zip(figures, subjects, strict=True)):
        assert figure.title.startswith(f"Figure {first + offset}. {subject}")
    assert [figure.spatial for figure in figures] == [True] + [False] * 6
    assert len({figure.key for figure in figures}) == 7


def test_another_trajectory_has_no_figure_numbers():
    figures = paper_figures([drawn_flights.run("a", "hover")])
    assert figures[1].title == "Longitudinal translational motion tracking"
    assert all(figure.key.startswith("hover-") for figure in figures)


def test_path_holds_flown_points_and_one_reference(two):
    path = paper_figures(two)[0]
    lines = {line.run: line for line in path.panels[0].lines}
    assert list(lines) == ["proposed", "pid", REFERENCE]
    expected = drawn_flights.circle(600)
    np.testing.assert_allclose(np.stack(lines["pid"].columns, axis=1), expected + 2.0 * OFFSET, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.stack(lines[REFERENCE].columns, axis=1), expected, rtol=0, atol=0)
    assert lines[REFERENCE].dashed


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_position_above_error_below(two, axis):
    figure = paper_figures(two)[1 + axis]
    above, below = figure.panels
    assert {line.run for line in above.lines} == {"proposed", "pid", REFERENCE}
    errors = {line.run: line.columns for line in below.lines}
    np.testing.assert_allclose(errors["proposed"][1], OFFSET[axis], atol=1e-12)
    np.testing.assert_allclose(errors["pid"][1], 2.0 * OFFSET[axis], atol=1e-12)
    assert errors["pid"][0][0] == pytest.approx(-APPROACH)
    assert figure.span == (0.0, 4.0)


def test_attitude_error_is_flown_minus_wanted(two):
    yaw = paper_figures(two)[6]
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
    above, below = paper_figures([run_from_tables("a", "case1", tables)])[6].panels
    for line in above.lines:
        np.testing.assert_allclose(line.columns[1], angle, atol=1e-9)
    np.testing.assert_allclose(below.lines[0].columns[1], 0.0, atol=1e-9)


def test_different_references_are_both_drawn():
    tables = drawn_flights.tables()
    tables["reference"]["p_w"] = tables["reference"]["p_w"] + 1.0
    runs = [drawn_flights.run("a"), run_from_tables("b", "case1", tables)]
    figures = paper_figures(runs)
    assert [line.label for line in figures[0].panels[0].lines] == ["a", "b", "a: reference", "b: reference"]
    assert runs_of(figures) == ["a", "b"]


def test_missing_topics_leave_lines_out():
    truth_only = {topic: table for topic, table in drawn_flights.tables().items() if topic == "truth"}
    run = run_from_tables("a", "", truth_only)
    figures = paper_figures([run])
    assert [len(panel.lines) for panel in figures[1].panels] == [1, 0]
    assert figures[1].panels[0].lines[0].columns[0][0] == 0.0
    assert inside_figures([run]) == []
    assert paper_figures([run_from_tables("a", "", {})]) == []


def test_insides(two):
    figures = {figure.key: figure for figure in inside_figures(two)}
    distance = {line.run: line.columns[1] for line in figures["case1-distance"].panels[0].lines}
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
    path = HEIGHT._replace(spatial=True)
    [alone, unshaded] = with_bands([HEIGHT, path], [run])
    assert unshaded.bands == ()
    assert [band.label for band in alone.bands] == ["TAKEOFF", "HOLD", "MISSION", "LAND", "guard in descend"]
    layout = specification(alone, colours(["a"]))["layout"]
    assert [shape["opacity"] for shape in layout["shapes"]] == [band.opacity for band in alone.bands]
    assert layout["annotations"][-1]["text"] == "LAND"
    [both] = with_bands([HEIGHT], [run, replace(run, name="b")])
    assert [band.label for band in both.bands] == ["a: guard in descend", "b: guard in descend"]


def test_the_time_of_a_mission_starts_with_its_trajectory():
    tables = drawn_flights.tables()
    tables["reference"]["trajectory_time"] = np.r_[np.zeros(100), np.full(450, -1e6), 0.5 + np.arange(50) * 0.01]
    run = run_from_tables("a", "case1", {**tables, "flight/mode": FLOWN["flight/mode"]})
    assert run.times("truth")[0] == pytest.approx(-5.0)  # MISSION from 5 s on, t = 0.5 at 5.5 s
    assert paper_figures([run])[1].span is None, "take-off and landing are shown"
