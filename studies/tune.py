"""Tune the knobs of controllers on training seeds (Optuna, TPE) and write the gains as ROS parameter files.

All controllers of a plan get the same sampler, budget, flights and objective. The objective is the mean over the
flights of position RMSE over its scale plus torque variation per second over its scale. A flight that does not end
costs a fixed amount, and again the share of it that was not flown. Trial 0 sets each knob to the default of its first
parameter, within the knob's bounds. Each controller is tuned as often as the plan says, by the sampler's seeds 1, 2,
...; a tuning that is there is not made again, and one that was stopped goes on with its next trial exactly as if it had
not been.
"""

import argparse
import csv
import io
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from study_plan import (
    Controller,
    Knob,
    Objective,
    StudyPlan,
    Tuning,
    find_plan,
    flight_of,
    gains_file,
    only,
    read_plan,
    tuned_overrides,
    tuning_mark,
)

from quad_core.cycle import seconds
from quad_core.parameters import ParameterError
from quad_core.plugins import PluginError
from quad_flight.engine import EngineError
from quad_flight.flight import Result, fly
from quad_flight.many import all_of

EXAMPLES = """examples:
  scripts/tune paper                         every controller of the plan, gains into PLAN_gains/N/CONTROLLER.yaml
  scripts/tune paper --only pid --tuning 1   one tuning of one of them
  scripts/tune mine.yaml                     again: goes on where it was stopped
  scripts/fly case1 --preset studies/study_gains/1/pid.yaml   fly the gains over ROS
"""


class Cost(NamedTuple):
    """What a trial costs, and of what: mean RMSE in m, mean torque variation in N m/s; NaN if a flight did not end."""

    cost: float
    rmse: float
    variation: float


class Trial(NamedTuple):
    """One set of knob values and what it cost."""

    number: int
    cost: float
    rmse: float
    variation: float
    values: dict[str, float]


class Tuned(NamedTuple):
    """All trials of a controller, and the best."""

    controller: Controller
    trials: list[Trial]

    @property
    def best(self) -> Trial:
        """The cheapest trial, the first of equals."""
        return min(self.trials, key=lambda trial: (trial.cost, trial.number))


def flight_cost(result: Result, objective: Objective, plant_period: int) -> Cost:
    """Return what one flight costs (no unit); ``plant_period`` in ns."""
    if result.outcome != "ended" or not result.score.samples:
        lost = float("nan")
        return Cost(objective.failure * (2.0 - result.steps / max(1, result.end_step)), lost, lost)
    length = seconds(result.end_step, plant_period) - result.trajectory_start
    variation = result.score.torque_variation / length
    return Cost(result.rmse / objective.rmse_scale + variation / objective.variation_scale, result.rmse, variation)


def cost(controller: Controller, values: Mapping[str, float], tuning: Tuning, threads: int = 2) -> Cost:
    """Return the means over the training flights with {knob: value}. Raises EngineError as ``fly``."""
    flights = [
        flight_of(controller.overrides(values), case, plant, condition=condition.overrides)._replace(seed=seed)
        for condition in tuning.conditions
        for plant in tuning.plants
        for case in tuning.cases
        for seed in tuning.seeds
    ]
    results = all_of(partial(fly, compiled=True, logging=False), flights, threads=threads)
    periods = [flight.setup.schedule.plant_period for flight in flights]
    costs = [flight_cost(result, tuning.objective, period) for result, period in zip(results, periods, strict=True)]
    return Cost(*(sum(column) / len(costs) for column in zip(*costs, strict=True)))


def defaults(controller: Controller) -> dict[str, float]:
    """Return {knob: default}: that of its first parameter, held within the knob's bounds."""
    flight = flight_of(controller.overrides({}), "hover", "rigid_body")
    found = {}
    for knob in controller.knobs:
        values = {field.name: field.default for field in flight.resolved[knob.node].all_fields()}
        value = float(values[knob.parameters[0]])
        found[knob.name] = min(max(value, knob.low), knob.high)
    return found


def tune(
    controller: Controller, tuning: Tuning, number: int, journal: Path, threads: int = 2, progress: bool = False
) -> Tuned:
    """Return the trials of tuning ``number`` of ``controller``, those in ``journal`` (a file) not flown again."""
    import optuna
    from optuna.storages.journal import JournalFileBackend
    from tqdm import tqdm

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    journal.parent.mkdir(parents=True, exist_ok=True)
    storage = optuna.storages.JournalStorage(JournalFileBackend(str(journal)))
    study = optuna.create_study(storage=storage, study_name=controller.name, load_if_exists=True)
    left = range(len(_finished(study)), tuning.trials)
    about = f"{controller.name}, tuning {number} of {tuning.tunings}"
    for count in tqdm(left, desc=about, unit="trial", disable=not progress):
        study.sampler = optuna.samplers.TPESampler(
            seed=number * 1_000_003 + count, n_startup_trials=20, multivariate=True
        )
        trial = study.ask() if count else _fixed(study, defaults(controller))
        found = cost(controller, {knob.name: _suggest(trial, knob) for knob in controller.knobs}, tuning, threads)
        trial.set_user_attr("parts", found[1:])
        study.tell(trial, found.cost)
    trials = [
        Trial(place, trial.value, *trial.user_attrs["parts"], dict(trial.params))
        for place, trial in enumerate(_finished(study))
    ]
    return Tuned(controller, trials[: tuning.trials])


def _finished(study: Any) -> list[Any]:
    from optuna.trial import TrialState

    return study.get_trials(states=(TrialState.COMPLETE,))  # type: ignore[no-any-return]


def _fixed(study: Any, values: Mapping[str, float]) -> Any:
    study.enqueue_trial(dict(values))
    return study.ask()


def _suggest(trial: Any, knob: Knob) -> float:
    return float(trial.suggest_float(knob.name, knob.low, knob.high, log=knob.log))


def parameter_file(tuned: Tuned, plan: StudyPlan, number: int) -> str:
    """Return the gains of the best trial as a ROS parameter file, with the record of the tuning as comments."""
    best, first = tuned.best, tuned.trials[0]
    tuning, objective = plan.tuning, plan.tuning.objective
    scales = f"position RMSE / {objective.rmse_scale} m + torque variation / {objective.variation_scale} N m/s"
    flights = f"seeds {', '.join(map(str, tuning.seeds))}, {', '.join(tuning.cases)}, {', '.join(tuning.plants)}"
    lines = [
        f"{tuned.controller.title}: gains from scripts/tune {plan.path.name}, tuning {number} of {tuning.tunings}",
        f"tuning: {tuning_mark(plan, tuned.controller)}",
        f"best of {len(tuned.trials)} trials: number {best.number}, cost {best.cost:.4f} (defaults: {first.cost:.4f})",
        f"cost: mean of {scales}",
        f"over {flights}, under {', '.join(each.name for each in tuning.conditions)}; sampler TPE, seed {number}",
    ]
    lines += [f"{k.name}: {best.values[k.name]:.6g} in [{k.low}, {k.high}]" for k in tuned.controller.knobs]
    content = {
        f"/**/{node}": {"ros__parameters": values} for node, values in tuned.controller.overrides(best.values).items()
    }
    comments = "".join(f"# {line}\n" for line in lines)
    return comments + str(yaml.safe_dump(content, sort_keys=False))


def trial_table(tuned: Tuned) -> str:
    """Return all trials as CSV: number, cost, RMSE in m, torque variation in N m/s, one column per knob."""
    text = io.StringIO()
    names = [knob.name for knob in tuned.controller.knobs]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*Trial._fields[:-1], *names])
    for trial in tuned.trials:
        values = [*trial[1:-1], *(trial.values[name] for name in names)]
        writer.writerow([trial.number, *(f"{value:.6g}" for value in values)])
    return text.getvalue()


def main(arguments: Sequence[str] | None = None) -> int:
    """Tune from the command line: 0 done, 2 usage or set-up."""
    parser = argparse.ArgumentParser(
        prog="tune", description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("plan", help="paper, or the path of a plan (as studies/study.yaml)")
    parser.add_argument("--only", action="append", metavar="CONTROLLER", help="may be repeated (default: all)")
    parser.add_argument("--tuning", type=int, action="append", metavar="N", help="may be repeated (default: all)")
    parser.add_argument("--gains", type=Path, metavar="DIR", help="folder of the tunings (default: PLAN_gains)")
    parser.add_argument("--threads", type=int, default=2, metavar="N", help="flights at once (default: 2)")
    options = parser.parse_args(arguments)
    try:
        plan = only(read_plan(find_plan(options.plan)), options.only or ())
        plan = plan._replace(gains=options.gains or plan.gains)
        for number in options.tuning or range(1, plan.tuning.tunings + 1):
            for controller in plan.controllers:
                _tuned(plan, controller, number, options.threads)
    except (ParameterError, PluginError, EngineError) as error:
        sys.stderr.write(f"tune: {error}\n")
        return 2
    return 0


def _tuned(plan: StudyPlan, controller: Controller, number: int, threads: int) -> None:
    """Make and write a tuning; one that is there is left. Raises ParameterError if that is of another plan."""
    target = gains_file(plan, controller.name, number)
    if target.is_file():
        tuned_overrides(plan, controller, number)
        return
    journal = target.with_suffix(f".{tuning_mark(plan, controller)}.journal")
    tuned = tune(controller, plan.tuning, number, journal, threads, progress=True)
    target.with_suffix(".csv").write_text(trial_table(tuned), encoding="utf-8")
    target.write_text(parameter_file(tuned, plan, number), encoding="utf-8")
    journal.unlink()
    best = tuned.best
    sys.stdout.write(f"{controller.name}: cost {best.cost:.4f} at trial {best.number}: {target}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
