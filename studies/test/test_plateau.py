"""The budget of a plan: which trials are compared, and that a shorter budget's best is flown as it was."""

import numpy as np
import pandas
import plateau
import pytest
import study_plan
from tune import Cost

from quad_core.parameters import ParameterError

PLAN = "laws_x500.yaml"


@pytest.fixture
def plan():
    return study_plan.read_plan(study_plan.find_plan(f"{study_plan.__file__.rpartition('/')[0]}/{PLAN}"))


def table(costs):
    return pandas.DataFrame({"number": range(len(costs)), "cost": costs, "knob": np.arange(len(costs)) * 1.0})


def test_the_best_only_falls_and_its_share_is_that_between_two_trials():
    best = plateau.best_costs(table([8.0, 9.0, 4.0, 5.0, 3.0]))
    assert best.tolist() == [8.0, 8.0, 4.0, 4.0, 3.0]
    assert plateau.fell(best, 2, 3) == 0.5
    assert plateau.fell(best, 4, 5) == 0.25


def test_the_cheapest_of_the_first_trials_is_taken(plan):
    knob = study_plan.Knob("knob", "position_controller", (), 0.0, 9.0, False)
    controller = plan.controllers[0]._replace(knobs=(knob,))
    trials = table([8.0, 4.0, 4.0, 3.0])
    assert plateau.values_of_best(trials, controller, 3) == {"knob": 1.0}
    assert plateau.values_of_best(trials, controller, 4) == {"knob": 3.0}


def test_a_row_flies_held_out_seeds_with_the_best_of_both_budgets(plan, monkeypatch):
    asked = []

    def flown(controller, values, tuning):
        asked.append((values["knob"], tuning.seeds))
        return Cost({1.0: 5.0, 3.0: 4.0}[values["knob"]], 0.0, 0.0)

    monkeypatch.setattr(plateau, "cost", flown)
    knob = study_plan.Knob("knob", "position_controller", (), 0.0, 9.0, False)
    controller = plan.controllers[0]._replace(knobs=(knob,), title="Mine")
    short = plan._replace(tuning=plan.tuning._replace(trials=2))
    cells = plateau.row(short, controller, {1: table([8.0, 4.0, 4.0, 3.0])}, [1001, 1002])
    assert asked == [(1.0, (1001, 1002)), (3.0, (1001, 1002))]
    assert cells == ["Mine", "1", "50.0 %", "25.0 %", "25.0 %", "5.00", "4.00", "-20.0 %"]


def test_missing_trials_are_named(plan, tmp_path):
    with pytest.raises(ParameterError, match=r"found no N/pid.csv"):
        plateau.trials(tmp_path, plan.controllers[0])


def test_the_picture_is_written(tmp_path):
    plateau.draw({"Mine": np.array([[2.0, 1.0, 0.9]])}, 2, tmp_path / "plateau.png")
    assert (tmp_path / "plateau.png").read_bytes().startswith(b"\x89PNG")
