"""A study flown by stand-in flights: files as described, statistics by hand, stopped and gone on."""

import json
import re

import numpy as np
import pandas
import pytest
import study
import study_table
import yaml
from scipy.stats import ttest_ind
from study_plan import Condition, gains_file, plan_mark, tuning_mark
from study_statistics import comparison, front, holm, mean_interval, paired, ratio, spread, summary
from test_study_plan import content, read

from quad_analysis.metrics import METRICS
from quad_core import plugins
from quad_core.parameters import ParameterError
from quad_flight.flight import Result
from quad_flight.score import Score

pytestmark = pytest.mark.skipif(
    "se3" not in plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)
ROWS = np.dtype([("stamp_ns", np.int64), ("trajectory_time", float), ("p_w", float, (3,)), ("q_wb", float, (4,))])


@pytest.fixture
def plan(tmp_path):
    plan_content = content()
    plan_content["tuning"] |= {"tunings": 2, "conditions": {"late": {"levels": ["delay"]}}}
    plan_content["controllers"]["other"] = {
        **plan_content["controllers"]["mine"],
        "title": "Other",
        "position": "se3",
        "knobs": {},
    }
    found = read(tmp_path, plan_content)
    for controller in found.controllers:
        for tuning in (1, 2):
            path = gains_file(found, controller.name, tuning)
            path.parent.mkdir(exist_ok=True, parents=True)
            path.write_text(
                f"# record\n# tuning: {tuning_mark(found, controller)}\n"
                f"position_controller:\n  ros__parameters:\n    law: {controller.position}\n"
                f"attitude_controller:\n  ros__parameters:\n    law: itsm\n    itsm.roll.exponent: 0.{tuning}\n"
            )
            path.with_suffix(".csv").write_text(
                "number,cost,rmse,variation,p\n0,3.0,0.02,2.0,1.0\n1,2.0,0.01,2.5,1.0\n"
            )
    return found


@pytest.fixture
def flown(monkeypatch):
    """Flights with a constant error of seed / 1000 m, 0.5 m more for se3; seed 101 of se3 diverges in tuning 1."""
    calls = []

    def fly(flight, *, compiled=False, logging=True):
        geometric = ".se3" in flight.modules.stages.position_controller.name
        calls.append(flight.seed)
        rows = np.zeros(3, ROWS)
        rows["stamp_ns"] = np.arange(3) * 10**7
        rows["trajectory_time"] = rows["stamp_ns"] * 1e-9
        rows["q_wb"] = [0.0, 0.0, 0.0, 1.0]
        truth = rows.copy()
        truth["p_w"][:, 0] = flight.seed / 1000 + (0.5 if geometric else 0.0)
        first = flight.setup.stages.attitude_controller.roll.exponent == 0.1
        outcome = "diverged" if geometric and flight.seed == 101 and first else "ended"
        squared = 3 * truth["p_w"][0, 0] ** 2
        return Result(outcome, 15, 15, 0.0, Score(3, squared, 0.0, 0.0, 0.0), {"truth": truth, "reference": rows})

    monkeypatch.setattr(study, "fly", fly)
    return calls


def test_a_study_leaves_the_files_that_are_described(plan, flown, tmp_path):
    out = tmp_path / "out"
    study.run(plan, 12, out, "the command")
    flights = pandas.read_parquet(out / "flights.parquet")
    assert list(flights.columns) == [*study.FLIGHT_KEYS, *study.NUMBERS]
    assert set(study.NUMBERS) >= set(METRICS)
    mine = flights[flights["controller"] == "mine"].set_index("seed")
    assert list(mine.index) == 2 * list(range(100, 112))
    assert set(mine["condition"]) == {"late"}
    np.testing.assert_allclose(mine["position_rmse"], mine.index / 1000)
    np.testing.assert_allclose(mine["cost"], mine.index / 10)  # over 0.01 m, without torque variation
    lost = flights[(flights["controller"] == "other") & (flights["seed"] == 101)].iloc[0]
    assert lost["outcome"] == "diverged"
    assert np.isnan(lost["position_rmse"])
    facts = json.loads((out / "study.json").read_text())
    assert (facts["command"], facts["seeds"]) == ("the command", list(range(100, 112)))
    assert (facts["plan"], facts["conditions"]) == (plan_mark(plan), {"late": {"simulator": {"sensor.delay": 0.02}}})
    assert facts["controllers"]["mine"]["tuning"]["2"][0] == "record"
    assert facts["controllers"]["other"]["gains"]["1"]["position_controller"] == {"law": "se3"}
    assert facts["metrics"]["position_rmse"][0] == "m"
    with np.load(out / "examples" / "other-case1.npz") as example:
        assert set(example.files) == {"truth", "reference"}
        assert example["truth"]["p_w"][0, 0] == pytest.approx(0.6)
    table = pandas.read_parquet(out / "summary.parquet").set_index(["controller", "metric"])
    other = table.loc[("other", "position_rmse")]
    assert (other["flights"], other["ended"], other["pairs"]) == (24, 23, 12)
    assert other["difference"] == pytest.approx(0.5)
    assert np.isnan(table.loc[("mine", "position_rmse"), "difference"])
    costs = pandas.read_parquet(out / "comparison.parquet").set_index(["controller", "condition"])
    assert costs.loc[("mine", "late"), "cost"] == pytest.approx(10.55)  # mean of 10.0 to 11.1
    assert (costs.loc[("other", "late"), "tunings"], costs.loc[("other", "late"), "lost"]) == (2, 1)
    assert list(pandas.read_parquet(out / "trials.parquet")["cost"]) == 4 * [3.0, 2.0]
    assert (out / "tables.md").read_text() == study_table.tables(out)
    late = yaml.safe_load((out / "conditions" / "late.yaml").read_text())
    assert late == {"/**/simulator": {"ros__parameters": {"sensor.delay": 0.02}}}
    assert "late & Mine & 2 & 10.550" in (out / "costs.tex").read_text()
    for name in ("costs", "front"):
        (box,) = re.findall(rb"/MediaBox \[ 0 0 ([0-9.]+) ", (out / f"{name}.pdf").read_bytes())
        assert float(box) == pytest.approx(88.0 / 25.4 * 72.0, abs=0.01)


def test_bold_cells_and_signs_of_a_table_are_latex():
    text = study_table.latex([["law", "p_x"], ["**-3 %**", "1 & 2"]])
    assert r"law & p\_x \\" in text
    assert r"\textbf{-3 \%} & 1 \& 2 \\" in text


def test_a_study_flies_the_conditions_of_its_tuning(plan):
    every = list(study.blocks(plan))
    assert [(block.controller, block.tuning, block.condition) for block in every] == [
        ("mine", 1, "late"), ("other", 1, "late"), ("mine", 2, "late"), ("other", 2, "late"),
    ]  # fmt: skip
    assert {block.flight.setup.sensing.delay for block in every} == {0.02}


def test_flights_of_another_size_of_a_level_are_not_mixed_in(plan):
    (late,) = plan.study.conditions
    later = late._replace(overrides={"simulator": {"sensor.delay": 0.03}})
    changed = plan._replace(study=plan.study._replace(conditions=(later,)))
    assert plan_mark(changed) != plan_mark(plan)
    assert study.identity(changed) != study.identity(plan)


def test_seeds_that_fly_alike_are_said():
    flights = pandas.DataFrame(
        [(name, 1, condition, "case1", "paper", seed, 1.0 + place + (seed if condition == "rough" else 0))
         for place, name in enumerate("ab") for condition in ("windy", "rough") for seed in (1, 2)],
        columns=["controller", "tuning", "condition", "case", "plant", "seed", "cost"],
    )  # fmt: skip
    assert study.alike(flights) == ["windy"]
    assert study.alike(flights[flights["seed"] == 1]) == []


def test_a_study_under_other_conditions_says_so(plan, capsys):
    windy = (*plan.tuning.conditions, Condition("windy", {"simulator": {"disturbance": "none"}}))
    said = study.conditions_text(plan.tuning.conditions, windy)
    assert said == "tuned under late; flown under late, windy; NOT tuned for: windy"
    assert "NOT" not in study.conditions_text(plan.tuning.conditions, plan.study.conditions)
    renamed = (plan.tuning.conditions[0]._replace(name="other"),)
    assert "NOT" not in study.conditions_text(plan.tuning.conditions, renamed)
    assert study.main([str(plan.path), "--check"]) == 0
    shown = capsys.readouterr().out
    assert plan_mark(plan) in shown
    assert "tuned under late; flown under late\n" in shown
    assert "mine: 2 of 2 tunings" in shown


def test_a_stopped_study_goes_on_and_ends_the_same(plan, flown, tmp_path):
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    study.run(plan, 12, whole, "c")
    study.run(plan, 12, stopped, "c")
    parts_before = len(list((stopped / "parts").glob("*.parquet")))
    (stopped / "parts" / "other-2-late-case1-rigid_body-110-2.parquet").unlink()
    (stopped / "flights.parquet").unlink()
    flown.clear()
    study.run(plan, 12, stopped, "c")
    assert parts_before == 8
    assert set(flown) == {110, 111}
    for name in ("flights.parquet", "summary.parquet"):
        pandas.testing.assert_frame_equal(pandas.read_parquet(whole / name), pandas.read_parquet(stopped / name))


def test_flights_of_other_gains_are_not_mixed_in(plan, flown, tmp_path):
    out = tmp_path / "out"
    study.run(plan, 2, out, "c")
    with gains_file(plan, "mine", 2).open("a") as gains:
        gains.write("# changed\n")
    with pytest.raises(ParameterError, match="another plan or other gains"):
        study.run(plan, 2, out, "c")


def test_usage_errors_are_exit_2(plan, tmp_path, capsys):
    assert study.main(["nothing", "--out", str(tmp_path / "x")]) == 2
    gains_file(plan, "mine", 2).unlink()
    assert study.main([str(plan.path), "--out", str(tmp_path / "x")]) == 2
    assert "no tuned gains" in capsys.readouterr().err
    with pytest.raises(SystemExit) as stop:
        study.main([str(plan.path), "--seeds", "0", "--out", str(tmp_path / "x")])
    assert stop.value.code == 2
    with pytest.raises(SystemExit) as stop:
        study.main([str(plan.path)])
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
            "controller": ["a"] * 3 + ["b"] * 3, "tuning": 1, "condition": "n",
            "case": "c", "plant": "p", "seed": [1, 2, 3, 3, 1, 2],
            "outcome": ["ended"] * 6, "m": [1.0, 5.0, 9.0, 10.0, 4.0, 7.0],
        }
    )  # fmt: skip
    row = summary(flights, ["a", "b"], ["m"], 99, 1).set_index("controller").loc["b"]
    assert row["difference"] == 2.0  # of 3, 2, 1; row by row they are 9, -1, -2
    assert (row["pairs"], row["median"]) == (3, 7.0)


def test_holm_by_hand():
    # 0.005 x 4, then 0.01 x 3, then 0.03 x 2, then 0.04 x 1, which may not be less than the one before it
    found = holm(np.array([0.01, 0.04, np.nan, 0.03, 0.005]))
    np.testing.assert_allclose(found, [0.03, 0.06, np.nan, 0.06, 0.02])
    assert holm(np.array([0.6, 0.7])).tolist() == [1.0, 1.0]
    assert len(holm(np.array([]))) == 0


def test_costs_over_tunings_by_hand():
    # mean 4, sd 1 of three: 4 +- 4.302653 / sqrt(3), the 97.5 % quantile of Student's t with two degrees of freedom
    np.testing.assert_allclose(mean_interval(np.array([3.0, 4.0, 5.0])), [4.0, 1.515862, 6.484138], rtol=1e-6)
    for few in ([4.0], [1.0, 9.0]):  # of two the interval would reach from -46 to 56
        mean, low, high = mean_interval(np.array(few))
        assert mean == np.mean(few)
        assert np.isnan([low, high]).all()
    # logarithms 0, 1, 2 and 1, 2, 3: standard error sqrt(2 / 3), four degrees of freedom, t = 1.224745, p = 0.287864
    middle, low, high, p = ratio(np.exp([1.0, 2.0, 3.0]), np.exp([0.0, 1.0, 2.0]))
    half = 2.776445 * np.sqrt(2.0 / 3.0)
    np.testing.assert_allclose([middle, low, high], np.exp([1.0, 1.0 - half, 1.0 + half]), rtol=1e-6)
    assert p == pytest.approx(0.287864, abs=1e-6)
    ours, theirs = np.random.default_rng(2).uniform(1.0, 5.0, (2, 7))
    same = ttest_ind(np.log(ours[:4]), np.log(theirs), equal_var=False)
    interval = np.exp([same.confidence_interval().low, same.confidence_interval().high])
    np.testing.assert_allclose(ratio(ours[:4], theirs)[1:], [*interval, same.pvalue])
    alone = ratio(np.array([2.0]), np.array([1.0, 1.0]))
    assert alone[0] == 2.0
    assert np.isnan(alone[1:]).all()


def test_the_family_is_all_conditions_and_controllers():
    rng = np.random.default_rng(3)
    flights = pandas.DataFrame(
        [
            {"controller": name, "condition": condition, "tuning": tuning, "outcome": "ended",
             "cost": float(np.exp(shift + 0.1 * rng.normal())) + (2.0 if condition == "windy" else 0.0)}
            for name, shift in (("a", 0.0), ("b", 0.0), ("c", 1.0))
            for condition in ("calm", "windy") for tuning in range(5) for _ in range(3)
        ]
    )  # fmt: skip
    found = comparison(flights, ["a", "b", "c"]).set_index(["controller", "condition"])
    assert set(found.index.get_level_values(1)) == {"calm", "windy", "all conditions"}
    calm, windy, every = (found.loc[("c", where), "cost"] for where in ("calm", "windy", "all conditions"))
    assert windy > calm + 1.5
    assert every == pytest.approx((calm + windy) / 2.0)
    others = found.drop("a", level=0)
    assert others["p"].notna().all()
    assert found.loc["a", "p"].isna().all()
    assert (others["p_holm"] >= others["p"]).all()
    assert others["p_holm"].min() == pytest.approx(6 * others["p"].min())
    assert (found.loc["c", "p_holm"] < 0.05).all()


def test_a_front_holds_what_nothing_beats():
    error = np.array([3.0, 1.0, 2.0, 2.0, np.nan, 4.0, 1.0])
    effort = np.array([1.0, 9.0, 4.0, 5.0, 0.0, 1.0, 9.0])
    assert front(error, effort).tolist() == [1, 2, 0]
    assert front(np.array([np.nan]), np.array([1.0])).tolist() == []


def test_tables_show_medians_and_differences(plan, flown, tmp_path):
    out = tmp_path / "out"
    study.run(plan, 3, out, "c")
    text = study_table.tables(out)
    assert "### case1, plant `rigid_body`, late" in text
    assert "| late | Other | 2 | " in text
    assert "| metric | Mine | Other |" in text
    assert "| position_rmse [m] | 0.101 (0.1 .. 0.102) | 0.601 (0.6 .. 0.602)<br>+0.5 [+0.5, +0.5] |" in text
    assert "attitude_rmse" not in text  # nobody has one
    assert "| flown to the end | 6 of 6 | 5 of 6 |" in text
