"""The report of a study shows what its files hold, and says which file is wrong."""

import base64
import json
import re

import numpy as np
import pytest
import study_report
from study_statistics import comparison

from quad_analysis.metrics import METRICS
from quad_flight_log.errors import FlightLogError

pandas = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")
pytest.importorskip("plotly")

CONTROLLERS = {"proposed": "AIBS + ABFNITSM", "pid": "PID"}
SEEDS = list(range(1001, 1007))


def example(error):
    steps = 300
    times = np.arange(steps) * 0.01
    head = [("step", "i8"), ("next_step", "i8"), ("stamp_ns", "i8")]
    truth = np.zeros(steps, [*head, ("p_w", "f8", 3), ("q_wb", "f8", 4)])
    truth["stamp_ns"] = np.arange(steps) * 10_000_000
    truth["p_w"][:, 0] = times + error
    truth["q_wb"][:, 3] = 1.0
    reference = np.zeros(steps, [*head, ("trajectory_time", "f8"), ("p_w", "f8", 3), ("yaw", "f8")])
    reference["stamp_ns"], reference["trajectory_time"] = truth["stamp_ns"], times
    reference["p_w"][:, 0] = times
    return {"truth": truth, "reference": reference}


def flights_table():
    rows = []
    for place, controller in enumerate(CONTROLLERS):
        for seed in SEEDS:
            bad = controller == "pid" and seed == 1003
            metrics = {name: float("nan") if bad else 1.0 + place + (seed - 1000) / 10 for name in METRICS}
            rows.append({"controller": controller, "tuning": 1, "condition": "late", "case": "case1",
                         "plant": "rigid_body", "seed": seed, "cost": 2.0 + place,
                         "outcome": "diverged" if bad else "ended", "steps": 10, **metrics})  # fmt: skip
    return pandas.DataFrame(rows)


def summary_table():
    numbers = {"flights": 6, "ended": 6, "median": 0.25, "low": 0.125, "high": 0.5, "pairs": 5}
    rows = []
    for controller in CONTROLLERS:
        nothing = controller == "proposed"
        paired = {"difference": 1.0, "difference_low": 0.75, "difference_high": 1.5}
        rows += [{"controller": controller, "case": "case1", "plant": "rigid_body", "condition": "late",
                  "metric": metric, **numbers,
                  **{key: float("nan") if nothing else value for key, value in paired.items()}}
                 for metric in METRICS]  # fmt: skip
    return pandas.DataFrame(rows)


@pytest.fixture
def directory(tmp_path):
    facts = {
        "name": "paper", "command": "scripts/study paper --seeds 6", "created": "2026-11-21T12:00:00Z", "commit": "abc",
        "versions": {"numpy": "2"}, "cases": ["case1"], "plants": ["rigid_body"], "conditions": {"late": {}},
        "conditions_text": "tuned under ideal; flown under late; NOT tuned for: late", "plan": "1234abcd",
        "seeds": SEEDS,
        "training_seeds": [1, 2, 3], "seed_rule": "1001 and on", "objective": "position_rmse",
        "controllers": {name: {"title": title, "position": "p", "attitude": "a", "tuning": {"trials": 77},
                               "gains": {"position_controller": {"law.gain": 4.5}}, "parameters": {}}
                        for name, title in CONTROLLERS.items()},
        "metrics": {name: list(about) for name, about in METRICS.items()},
    }  # fmt: skip
    (tmp_path / "study.json").write_text(json.dumps(facts))
    flights_table().to_parquet(tmp_path / "flights.parquet")
    summary_table().to_parquet(tmp_path / "summary.parquet")
    comparison(flights_table(), list(CONTROLLERS)).to_parquet(tmp_path / "comparison.parquet")
    rows = [(name, tuning, n, 9.0 / (n + tuning), 0.01 * n, 5.0 - n)
            for name in CONTROLLERS for tuning in (1, 3) for n in range(4)]  # fmt: skip
    columns = ["controller", "tuning", "number", "cost", "rmse", "variation"]
    pandas.DataFrame(rows, columns=columns).to_parquet(tmp_path / "trials.parquet")
    (tmp_path / "examples").mkdir()
    for name, error in (("proposed", 0.5), ("pid", 0.75)):
        np.savez(tmp_path / "examples" / f"{name}-case1.npz", **example(error))
    return tmp_path


def data_of(text):
    found = re.search(r'<script type="application/json" id="report-data">(.*?)</script>', text, re.DOTALL)
    return json.loads(found[1])


def numbers(column):
    return np.frombuffer(base64.b64decode(column["bdata"]), "<f4")


def test_report_holds_tables_figures_and_origin(directory, capsys):
    assert study_report.main([str(directory)]) == 0
    assert capsys.readouterr().out.strip() == str(directory / "report.html")
    text = (directory / "report.html").read_text()
    for expected in ("scripts/study paper --seeds 6", "6: 1001 to 1006", "1001 and on", "trials: 77", "law.gain: 4.5",
                     "1234abcd", "NOT tuned for: late", "+50.0 %", "0.25 [0.125, 0.5]", "+1 [+0.75, +1.5]",
                     "PID 5 of 6", "AIBS + ABFNITSM 6 of 6"):  # fmt: skip
        assert expected in text
    data = data_of(text)
    error = [trace for trace in data["figure-06-case1-x"]["data"] if trace["yaxis"] == "y2"]
    assert [trace["meta"]["run"] for trace in error] == ["AIBS + ABFNITSM", "PID"]
    np.testing.assert_allclose(numbers(error[1]["y"]), 0.75, rtol=1e-6)


def test_every_flight_is_a_dot_over_its_controller(directory):
    data = data_of(study_report.write_report(directory).read_text())
    figure = data["metrics-case1-rigid_body-late-tracking"]
    assert figure["layout"]["xaxis"]["ticktext"] == ["AIBS + ABFNITSM", "PID"]
    first, second = (trace for trace in figure["data"] if trace["yaxis"] == "y")
    assert first["mode"] == second["mode"] == "markers"
    np.testing.assert_allclose(numbers(first["y"]), [1.1, 1.2, 1.3, 1.4, 1.5, 1.6], rtol=1e-6)
    np.testing.assert_allclose(numbers(second["y"]), [2.1, 2.2, 2.4, 2.5, 2.6], rtol=1e-6)
    assert np.round(numbers(second["x"])).tolist() == [1.0] * 5
    shown = {panel["title"]["text"] for name, panel in figure["layout"].items() if "yaxis" in name}
    assert "position<br>rmse<br>[m]" in shown


def test_the_search_and_the_front_are_drawn(directory):
    data = data_of(study_report.write_report(directory).read_text())
    best = data["plateau"]["data"][0]
    np.testing.assert_allclose(numbers(best["y"]), [6.0, 3.375, 2.4, 1.875], rtol=1e-6)  # median of 9/n and 9/(n + 2)
    front = data["front"]["data"][0]
    np.testing.assert_allclose(numbers(front["x"]), [5.0, 4.0, 3.0, 2.0], rtol=1e-6)
    np.testing.assert_allclose(numbers(front["y"]), [0.0, 10.0, 20.0, 30.0], atol=1e-5)


@pytest.mark.parametrize("name", study_report.FILES)
def test_what_is_missing_or_damaged_is_named(directory, name, capsys):
    (directory / name).write_bytes(b"{nothing")
    assert study_report.main([str(directory)]) == 2
    assert name in capsys.readouterr().err
    (directory / name).unlink()
    with pytest.raises(FlightLogError, match=re.escape(name)):
        study_report.read_study(directory)


def test_damaged_example_is_named(directory):
    path = directory / "examples" / "pid-case1.npz"
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(FlightLogError, match=r"pid-case1\.npz"):
        study_report.read_study(directory)


def test_incomplete_facts_are_named(directory):
    (directory / "study.json").write_text('{"name": "x"}')
    with pytest.raises(FlightLogError, match="command, cases"):
        study_report.read_study(directory)
