"""Tuning: cost of a flight by hand, search on a known bowl, going on after a stop, and files that nodes load."""

import csv
import io

import pytest
import tune as tuning_module
from study_plan import Objective
from test_study_plan import content, read
from tune import defaults, flight_cost, main, parameter_file, trial_table, tune

from quad_core import plugins
from quad_flight.flight import Result, flight_from_files
from quad_flight.loop import Score

pytestmark = pytest.mark.skipif(
    "se3" not in plugins.names(plugins.POSITION_LAW), reason="plug-ins are not installed: run scripts/setup"
)
OBJECTIVE = Objective(0.01, 2.0, 100.0)
PERIOD = 2_000_000


def result(outcome="ended", steps=5000, squared=4e-4 * 800, variation=24.0):
    return Result(outcome, steps, 5000, 2.0, Score(800, squared, 0.1, 0.0, variation), {})


def test_cost_of_a_flight_by_hand():
    # RMSE 0.02 m over 0.01 m; 24 N m in 8 s over 2 N m/s
    assert flight_cost(result(), OBJECTIVE, PERIOD) == pytest.approx(2.0 + 1.5)


def test_a_flight_that_ends_early_costs_more_the_earlier():
    late, early = (flight_cost(result("diverged", steps), OBJECTIVE, PERIOD) for steps in (4000, 1000))
    assert (late, early) == (pytest.approx(120.0), pytest.approx(180.0))
    assert flight_cost(result("refused", 5000), OBJECTIVE, PERIOD) == pytest.approx(100.0)


@pytest.fixture
def bowl(monkeypatch):
    """Cost with its least value at p = 3, k = 0.6; counts its calls."""
    calls = []

    def cost(controller, values, tuning, threads=2):
        calls.append(dict(values))
        return (values["p"] - 3.0) ** 2 + 10.0 * (values["k"] - 0.6) ** 2

    monkeypatch.setattr(tuning_module, "cost", cost)
    return calls


def test_search_begins_with_the_defaults_and_finds_the_bowl(tmp_path, bowl):
    plan = read(tmp_path, content())
    (mine,) = plan.controllers
    tuned = tune(mine, plan.tuning._replace(trials=60))
    assert bowl[0] == defaults(mine) == {"p": 2.5, "k": 0.7}
    assert len(tuned.trials) == 60
    assert tuned.best.cost == min(trial.cost for trial in tuned.trials) < 0.02
    assert all(1.0 <= call["p"] <= 4.0 and 0.1 <= call["k"] <= 1.0 for call in bowl)


def test_a_stopped_tuning_goes_on_as_if_it_had_not_been(tmp_path, bowl):
    plan = read(tmp_path, content())
    (mine,) = plan.controllers
    whole = tune(mine, plan.tuning._replace(trials=30))
    storage = tmp_path / "journal.log"
    tune(mine, plan.tuning._replace(trials=23), storage)
    bowl.clear()
    again = tune(mine, plan.tuning._replace(trials=30), storage)
    assert len(bowl) == 7
    assert again.trials == whole.trials


def test_gains_are_a_parameter_file_of_the_nodes(tmp_path, bowl, capsys):
    read(tmp_path, content())
    out = tmp_path / "gains"
    assert main([str(tmp_path / "small.yaml"), "--out", str(out), "--trials", "8"]) == 0
    flight = flight_from_files([out / "mine.yaml"])
    with (out / "mine.csv").open() as table:
        rows = list(csv.DictReader(table))
    best = min(rows, key=lambda row: float(row["cost"]))
    assert len(rows) == 8
    assert flight.setup.stages.position_controller.xy.position == flight.setup.stages.position_controller.z.position
    assert flight.setup.stages.position_controller.z.position == pytest.approx(float(best["p"]), rel=1e-5)
    assert flight.setup.stages.attitude_controller.roll.exponent == pytest.approx(float(best["k"]), rel=1e-5)
    text = (out / "mine.yaml").read_text()
    assert "best of 8 trials" in text
    assert "in [1.0, 4.0]" in text
    assert "mine: cost" in capsys.readouterr().out


def test_the_table_holds_every_trial(tmp_path, bowl):
    plan = read(tmp_path, content())
    tuned = tune(plan.controllers[0], plan.tuning._replace(trials=3))
    rows = list(csv.reader(io.StringIO(trial_table(tuned))))
    assert rows[0] == ["number", "cost", "p", "k"]
    assert [row[0] for row in rows[1:]] == ["0", "1", "2"]
    assert parameter_file(tuned, plan).startswith("# Mine: gains from")


def test_another_sampler_seed_searches_elsewhere_and_is_recorded(tmp_path, bowl):
    plan = read(tmp_path, content())
    for seed in ("5", "6"):
        assert main([str(plan.path), "--trials", "4", "--sampler-seed", seed, "--out", str(tmp_path / seed)]) == 0
        assert f"sampler TPE, seed {seed}\n" in (tmp_path / seed / "mine.yaml").read_text()
    assert bowl[0] == bowl[4] == defaults(plan.controllers[0])
    assert bowl[1:4] != bowl[5:8]


@pytest.mark.parametrize("arguments", [["nothing"], ["paper", "--only", "kite"]])
def test_bad_usage_is_exit_2(arguments, capsys):
    assert main(arguments) == 2
    assert "found" in capsys.readouterr().err
