"""A study flown by stand-in flights: files as described, statistics by hand, stopped and gone on."""

import json

import numpy as np
import pandas
import pytest
import study
import study_table
from study_plan import gains_file
from study_statistics import paired, spread, summary
from test_study_plan import content, read

from quad_core import plugins
from quad_core.parameters import ParameterError
from quad_flight.flight import Result
from quad_flight.loop import Score
from quad_flight_log.analysis.metrics import METRICS

pytestmark = pytest.mark.skipif(
    "se3" not in plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)
ROWS = np.dtype([("stamp_ns", np.int64), ("trajectory_time", float), ("p_w", float, (3,)), ("q_wb", float, (4,))])


@pytest.fixture
def plan(tmp_path):
    plan_content = content()
    plan_content["controllers"]["other"] = {
        **plan_content["controllers"]["mine"],
        "title": "Other",
        "position": "se3",
        "knobs": {},
    }
    found = read(tmp_path, plan_content)
    for controller in found.controllers:
        path = gains_file(found, controller.name)
        path.parent.mkdir(exist_ok=True)
        path.write_text(
            f"# record\nposition_controller:\n  ros__parameters:\n    law: {controller.position}\n"
            f"attitude_controller:\n  ros__parameters:\n    law: itsm\n"
        )
    return found


@pytest.fixture
def flown(monkeypatch):
    """Flights with a constant error of seed / 1000 m, 0.5 m more for se3; seed 101 of se3 diverges."""
    calls = []

    def fly(flight, *, compiled=False, logging=True):
        geometric = ".se3" in flight.modules.stages.position_controller.__name__
        calls.append(flight.seed)
        rows = np.zeros(3, ROWS)
        rows["stamp_ns"] = np.arange(3) * 10**7
        rows["trajectory_time"] = rows["stamp_ns"] * 1e-9
        rows["q_wb"] = [0.0, 0.0, 0.0, 1.0]
        truth = rows.copy()
        truth["p_w"][:, 0] = flight.seed / 1000 + (0.5 if geometric else 0.0)
        outcome = "diverged" if geometric and flight.seed == 101 else "ended"
        return Result(outcome, 15, 15, 0.0, Score(3, 0.0, 0.0, 0.0, 0.0), {"truth": truth, "reference": rows})

    monkeypatch.setattr(study, "fly", fly)
    return calls


def test_a_study_leaves_the_files_that_are_described(plan, flown, tmp_path):
    out = tmp_path / "out"
    study.run(plan, 12, out, "the command")
    flights = pandas.read_parquet(out / "flights.parquet")
    assert list(flights.columns) == [*study.FLIGHT_KEYS, *METRICS]
    assert flights.groupby("controller")["seed"].apply(list)["mine"] == list(range(100, 112))
    mine = flights[flights["controller"] == "mine"].set_index("seed")
    np.testing.assert_allclose(mine["position_rmse"], mine.index / 1000)
    lost = flights[(flights["controller"] == "other") & (flights["seed"] == 101)].iloc[0]
    assert lost["outcome"] == "diverged"
    assert np.isnan(lost["position_rmse"])
    facts = json.loads((out / "study.json").read_text())
    assert (facts["command"], facts["seeds"]) == ("the command", list(range(100, 112)))
    assert facts["controllers"]["mine"]["tuning"] == ["record"]
    assert facts["controllers"]["other"]["gains"]["position_controller"] == {"law": "se3"}
    assert facts["metrics"]["position_rmse"][0] == "m"
    with np.load(out / "examples" / "other-case1.npz") as example:
        assert set(example.files) == {"truth", "reference"}
        assert example["truth"]["p_w"][0, 0] == pytest.approx(0.6)
    table = pandas.read_parquet(out / "summary.parquet").set_index(["controller", "metric"])
    other = table.loc[("other", "position_rmse")]
    assert (other["flights"], other["ended"], other["pairs"]) == (12, 11, 11)
    assert other["difference"] == pytest.approx(0.5)
    assert np.isnan(table.loc[("mine", "position_rmse"), "difference"])


def test_a_stopped_study_goes_on_and_ends_the_same(plan, flown, tmp_path):
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    study.run(plan, 12, whole, "c")
    study.run(plan, 12, stopped, "c")
    parts_before = len(list((stopped / "parts").glob("*.parquet")))
    (stopped / "parts" / "other-case1-rigid_body-110-2.parquet").unlink()
    (stopped / "flights.parquet").unlink()
    flown.clear()
    study.run(plan, 12, stopped, "c")
    assert parts_before == 4
    assert set(flown) == {110, 111}
    for name in ("flights.parquet", "summary.parquet"):
        pandas.testing.assert_frame_equal(pandas.read_parquet(whole / name), pandas.read_parquet(stopped / name))


def test_flights_of_other_gains_are_not_mixed_in(plan, flown, tmp_path):
    out = tmp_path / "out"
    study.run(plan, 2, out, "c")
    with gains_file(plan, "mine").open("a") as gains:
        gains.write("# changed\n")
    with pytest.raises(ParameterError, match="another plan or other gains"):
        study.run(plan, 2, out, "c")


def test_usage_errors_are_exit_2(plan, tmp_path, capsys):
    assert study.main(["nothing", "--out", str(tmp_path / "x")]) == 2
    gains_file(plan, "mine").unlink()
    assert study.main([str(plan.path), "--out", str(tmp_path / "x")]) == 2
    assert "no tuned gains" in capsys.readouterr().err
    with pytest.raises(SystemExit) as stop:
        study.main([str(plan.path), "--seeds", "0", "--out", str(tmp_path / "x")])
    assert stop.value.code == 2


def test_a_study_of_some_plants(plan):
    wide = plan._replace(study=plan.study._replace(plants=("rigid_body", "paper")))
    assert study.restricted(wide, ["paper"]).study.plants == ("paper",)
    assert study.restricted(wide, []) == wide
    with pytest.raises(ParameterError, match="--plant: found 'kite', expected one of rigid_body, paper"):
        study.restricted(wide, ["kite"])


def test_spread_and_paired_by_hand():
    values = np.array([np.nan, *np.arange(21.0)])
    assert spread(values) == {"median": 10.0, "low": 1.0, "high": 19.0}
    assert np.isnan(spread(np.array([np.nan]))["median"])
    same = paired(np.full(5, 0.25), 99, 1)
    assert same == {"pairs": 5, "difference": 0.25, "difference_low": 0.25, "difference_high": 0.25}
    assert paired(np.array([np.nan]), 99, 1)["pairs"] == 0
    assert paired(np.array([9.0, 1.0, np.nan, 2.0]), 99, 1)["difference"] == 2.0


def test_intervals_hold_the_true_median_as_often_as_they_say():
    rng = np.random.default_rng(5)
    hits = 0
    for _ in range(200):
        found = paired(rng.normal(0.3, 1.0, 50), 400, 1)
        hits += found["difference_low"] <= 0.3 <= found["difference_high"]
    assert 180 <= hits <= 199


def test_summary_pairs_by_seed_whatever_the_order():
    flights = pandas.DataFrame(
        {
            "controller": ["a"] * 3 + ["b"] * 3, "case": "c", "plant": "p", "seed": [1, 2, 3, 3, 1, 2],
            "outcome": ["ended"] * 6, "m": [1.0, 5.0, 9.0, 10.0, 4.0, 7.0],
        }
    )  # fmt: skip
    row = summary(flights, ["a", "b"], ["m"], 99, 1).set_index("controller").loc["b"]
    assert row["difference"] == 2.0  # of 3, 2, 1; row by row they are 9, -1, -2
    assert (row["pairs"], row["median"]) == (3, 7.0)


def test_tables_show_medians_and_differences(plan, flown, tmp_path, capsys):
    out = tmp_path / "out"
    study.run(plan, 3, out, "c")
    text = study_table.tables(out, metrics=["position_rmse", "attitude_rmse"])
    assert "### case1, plant `rigid_body`" in text
    assert "| metric | Mine | Other |" in text
    assert "| position_rmse [m] | 0.101 (0.1 .. 0.102) | 0.601 (0.6 .. 0.602)<br>+0.5 [+0.5, +0.5] |" in text
    assert "attitude_rmse" not in text  # nobody has one
    assert "| flown to the end | 3 of 3 | 2 of 3 |" in text
    turned = study_table.tables(out, metrics=["position_rmse"], against="other")
    assert "| metric | Other | Mine |" in turned
    assert "| position_rmse [m] | 0.601 (0.6 .. 0.602) | 0.101 (0.1 .. 0.102)<br>-0.5 [-0.5, -0.5] |" in turned
    assert study_table.main([str(out), "--against", "kite"]) == 2
    assert study_table.main([str(out), "--metric", "speed"]) == 2
    assert study_table.main([str(tmp_path / "none")]) == 2
    assert "expected one of duration" in capsys.readouterr().err
