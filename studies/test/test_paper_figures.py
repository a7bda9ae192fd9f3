"""The page of the paper's figures says "seen" where the flown errors say so, and holds all fourteen figures."""

import re

import numpy as np
import paper_figures
import pytest
from paper_figures import OTHER, PROPOSED, ROOT, Shown, figure_text, first_below, shown

from quad_report.figures import Figure
from quad_report.flight_figures import run_from_tables


def tables(error):
    """Return a flight of 30 s along x whose error in x is ``error`` after 20 s, and 9 m before."""
    steps = 3000
    times = np.arange(steps) * 0.01
    truth = np.zeros(steps, [("stamp_ns", "i8"), ("p_w", "f8", 3), ("q_wb", "f8", 4)])
    truth["stamp_ns"] = np.arange(steps) * 10_000_000
    truth["p_w"][:, 0] = times + np.where(times < 20.0, 9.0, error)
    truth["q_wb"][:, 3] = 1.0
    reference = np.zeros(steps, [("stamp_ns", "i8"), ("trajectory_time", "f8"), ("p_w", "f8", 3), ("yaw", "f8")])
    reference["stamp_ns"], reference["trajectory_time"] = truth["stamp_ns"], times
    reference["p_w"][:, 0] = times
    setpoint = np.zeros(steps, [("stamp_ns", "i8"), ("angles", "f8", 3), ("thrust", "f8")])
    setpoint["stamp_ns"] = truth["stamp_ns"]
    return {"truth": truth, "reference": reference, "attitude_setpoint": setpoint}


def test_errors_count_after_the_way_from_the_origin():
    runs = [run_from_tables(name, "case1", tables(error)) for name, error in ((PROPOSED, 0.25), (OTHER, -0.5))]
    path, x, *_ = shown(runs)
    for found in (path, x):
        assert found.rms == {PROPOSED: pytest.approx(0.25), OTHER: pytest.approx(0.5)}
        assert found.largest == {PROPOSED: pytest.approx(0.25), OTHER: pytest.approx(0.5)}
    assert [each.unit for each in shown(runs)] == ["m"] * 4 + ["rad"] * 3


@pytest.mark.parametrize(
    ("proposed", "other", "verdict"),
    [(0.9, 1.0, "**Seen**"), (0.96, 1.0, "**Not seen**: no difference"), (1.0, 0.9, "**Not seen**: IBS-ITSM has less")],
)
def test_a_claim_is_seen_where_the_proposed_controller_has_clearly_less_error(proposed, other, verdict):
    figure = Figure("figure-06-case1-x", "Figure 6. X", "", ())
    both = {PROPOSED: proposed, OTHER: other}
    text = "\n".join(figure_text(Shown(figure, both, both, "m"), "it is better"))
    assert verdict in text
    assert f"proposed {1000 * proposed:.3g} mm ({1000 * proposed:.3g})" in text
    assert "The paper: it is better." in text


def test_an_arrival_is_the_first_time_below_the_limit():
    times = np.arange(0.0, 10.0, 0.5)
    errors = np.where(times < 5.0, 1.0, 0.01)
    assert first_below(times, errors, 0.1) == 5.0
    assert np.isnan(first_below(times, errors + 1.0, 0.1))


def test_the_page_holds_all_figures_and_counts_its_own_verdicts():
    text = (ROOT / "docs" / "results" / "paper_figures.md").read_text()
    pictures = re.findall(r"\((\.\./images/paper/figure-(\d\d)\.svg)\)", text)
    assert [int(number) for _, number in pictures] == list(range(5, 19))
    assert all((ROOT / "docs" / "results" / path).is_file() for path, _ in pictures)
    stated = re.search(r"Of 14 figures (\d+) show", text)
    assert stated
    assert int(stated[1]) == text.count("**Seen**")
    assert text.count("**Seen**") + text.count("**Not seen**") == 14
    assert paper_figures.TEXTS["case1"].keys() | paper_figures.TEXTS["case2"].keys() == set(range(5, 19))
