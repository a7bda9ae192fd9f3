"""Tuning: cost of a flight by hand, search on a known bowl, going on after a stop, and files that nodes load."""

import csv
import io
import math

import pytest
import tune as tuning_module
from study_plan import Objective, gains_file, tuned_overrides
from test_study_plan import content, read
from tune import Cost, defaults, flight_cost, main, tune

from quad_core import plugins
from quad_flight.flight import Result, from_names
from quad_flight.score import Score

pytestmark = pytest.mark.skipif(
    "se3" not in plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)
OBJECTIVE = Objective(0.01, 2.0, 100.0)
PERIOD = 2_000_000


def result(outcome="ended", steps=5000, squared=4e-4 * 800, variation=24.0):
    return Result(outcome, steps, 5000, 2.0, Score(800, squared, 0.1, 0.0, variation), {})


def test_cost_of_a_flight_by_hand():
    # RMSE 0.02 m over 0.01 m; 24 N m in 8 s over 2 N m/s
    assert flight_cost(result(), OBJECTIVE, PERIOD) == pytest.approx((2.0 + 1.5, 0.02, 3.0))


def test_a_flight_that_ends_early_costs_more_the_earlier():
    late, early = (flight_cost(result("diverged", steps), OBJECTIVE, PERIOD).cost for steps in (4000, 1000))
    assert (late, early) == (pytest.approx(120.0), pytest.approx(180.0))
    refused = flight_cost(result("refused", 5000), OBJECTIVE, PERIOD)
    assert (refused.cost, math.isnan(refused.rmse)) == (pytest.approx(100.0), True)


def test_every_training_flight_has_its_condition_and_seed(tmp_path, monkeypatch):
    asked = content()
    asked["tuning"]["conditions"] = {"late": {"levels": ["delay"]}, "calm": {"levels": ["still_air"]}}
    plan = read(tmp_path, asked)
    flown = []

    def all_of(function, flights, threads):
        flown.extend((flight.setup.sensing.delay, flight.seed) for flight in flights)
        return [result(variation=24.0 * (1 + place)) for place in range(len(flights))]

    monkeypatch.setattr(tuning_module, "all_of", all_of)
    found = tuning_module.cost(plan.controllers[0], {"p": 2.0}, plan.tuning)
    assert flown == [(0.02, 1), (0.02, 2), (0.0, 1), (0.0, 2)]
    assert found == pytest.approx((2.0 + 1.5 * 2.5, 0.02, 3.0 * 2.5))


@pytest.fixture
def bowl(monkeypatch):
    """Cost with its least value at p = 3, k = 0.6; counts its calls."""
    calls = []

    def cost(controller, values, tuning, threads=2):
        calls.append(dict(values))
        found = (values["p"] - 3.0) ** 2 + 10.0 * (values["k"] - 0.6) ** 2
        return Cost(found, 0.01 * found, float("nan"))

    monkeypatch.setattr(tuning_module, "cost", cost)
    return calls


def test_search_begins_with_the_defaults_and_finds_the_bowl(tmp_path, bowl):
    plan = read(tmp_path, content())
    (mine,) = plan.controllers
    tuned = tune(mine, plan.tuning._replace(trials=60), 1, tmp_path / "journal")
    assert bowl[0] == defaults(mine) == {"p": 2.5, "k": 0.7}
    assert len(tuned.trials) == 60
    assert tuned.best.cost == min(trial.cost for trial in tuned.trials) < 0.02
    assert all(1.0 <= call["p"] <= 4.0 and 0.1 <= call["k"] <= 1.0 for call in bowl)


def test_a_stopped_tuning_goes_on_as_if_it_had_not_been(tmp_path, bowl):
    plan = read(tmp_path, content())
    (mine,) = plan.controllers
    whole = tune(mine, plan.tuning._replace(trials=30), 1, tmp_path / "whole")
    tune(mine, plan.tuning._replace(trials=23), 1, tmp_path / "stopped")
    bowl.clear()
    again = tune(mine, plan.tuning._replace(trials=30), 1, tmp_path / "stopped")
    assert len(bowl) == 7
    assert [trial[:3] for trial in again.trials] == [trial[:3] for trial in whole.trials]
    assert again.trials[29].rmse == pytest.approx(0.01 * again.trials[29].cost)


def test_gains_are_a_parameter_file_of_the_nodes(tmp_path, bowl, capsys):
    asked = content()
    asked["tuning"] |= {"trials": 8, "tunings": 2}
    plan = read(tmp_path, asked)
    assert main([str(plan.path)]) == 0
    path = gains_file(plan, "mine", 1)
    flight = from_names("case1", preset=path)
    rows = list(csv.DictReader(io.StringIO(path.with_suffix(".csv").read_text())))
    best = min(rows, key=lambda row: float(row["cost"]))
    assert list(rows[0]) == ["number", "cost", "rmse", "variation", "p", "k"]
    assert [row["number"] for row in rows] == [str(number) for number in range(8)]
    assert flight.setup.stages.position_controller.xy.position == flight.setup.stages.position_controller.z.position
    assert flight.setup.stages.position_controller.z.position == pytest.approx(float(best["p"]), rel=1e-5)
    assert flight.setup.stages.attitude_controller.roll.exponent == pytest.approx(float(best["k"]), rel=1e-5)
    text = path.read_text()
    assert "best of 8 trials" in text
    assert "in [1.0, 4.0]" in text
    assert "under nominal; sampler TPE, seed 1\n" in text
    assert "mine: cost" in capsys.readouterr().out
    assert bowl[0] == bowl[8] == defaults(plan.controllers[0])
    assert bowl[1:8] != bowl[9:16]  # another tuning searches elsewhere
    assert {each.name for each in path.parent.iterdir()} == {"mine.yaml", "mine.csv"}


def test_a_tuning_that_is_there_is_not_made_again(tmp_path, bowl, capsys):
    plan = read(tmp_path, content())
    elsewhere = tmp_path / "elsewhere"
    for _ in range(2):
        assert main([str(plan.path), "--gains", str(elsewhere), "--tuning", "3"]) == 0
    assert len(bowl) == plan.tuning.trials
    assert (
        tuned_overrides(plan._replace(gains=elsewhere), plan.controllers[0], 3)["position_controller"]["law"] == "pid"
    )
    changed = content()
    changed["tuning"]["trials"] = 5
    read(tmp_path, changed)
    assert main([str(plan.path), "--gains", str(elsewhere), "--tuning", "3"]) == 2
    assert "tune again" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["nothing"], ["paper", "--only", "kite"]])
def test_bad_usage_is_exit_2(arguments, capsys):
    assert main(arguments) == 2
    assert "found" in capsys.readouterr().err
