"""Tune the knobs of controllers on training seeds (Optuna, TPE) and write the gains as ROS parameter files.

All controllers of a plan get the same sampler, budget, flights and objective. The objective is the mean over the
flights of position RMSE over its scale plus torque variation per second over its scale. A flight that does not end
costs a fixed amount plus the share that was not flown. Trial 0 are the defaults. Each trial has a sampler seed of its
own, so a tuning that was stopped goes on from its storage exactly as if it had not been.
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
    read_plan,
)

from quad_core.cycle import seconds
from quad_core.parameters import ParameterError
from quad_core.plugins import PluginError
from quad_flight.engine import EngineError
from quad_flight.flight import Result, fly
from quad_flight.many import all_of

EXAMPLES = """examples:
  scripts/tune paper                         every controller of the plan, gains next to the plan
  scripts/tune paper --only pid --trials 20  a quick look at one of them
  scripts/tune mine.yaml --storage tune.log  goes on where it was stopped
  scripts/tune mine.yaml --sampler-seed 2 --out gains/2    again with another seed of the sampler: how much is luck
  scripts/fly case1 --preset studies/study_gains/pid.yaml   fly the gains over ROS
"""


class Trial(NamedTuple):
    """One set of knob values and what it cost."""

    number: int
    cost: float
    values: dict[str, float]


class Tuned(NamedTuple):
    """All trials of a controller, and the best."""

    controller: Controller
    trials: list[Trial]

    @property
    def best(self) -> Trial:
        """The cheapest trial, the first of equals."""
        return min(self.trials, key=lambda trial: (trial.cost, trial.number))


def flight_cost(result: Result, objective: Objective, plant_period: int) -> float:
    """Return what one flight costs (no unit); ``plant_period`` in ns."""
    if result.outcome != "ended" or not result.score.samples:
        return objective.failure * (2.0 - result.steps / max(1, result.end_step))
    length = seconds(result.end_step, plant_period) - result.trajectory_start
    variation = result.score.torque_variation / length
    return result.rmse / objective.rmse_scale + variation / objective.variation_scale


def cost(controller: Controller, values: Mapping[str, float], tuning: Tuning, threads: int = 2) -> float:
    """Return the mean cost of the training flights with {knob: value}. Raises EngineError as ``fly``."""
    flights = [
        flight_of(controller.overrides(values), case, plant, condition=condition)._replace(seed=seed)
        for condition in tuning.conditions
        for plant in tuning.plants
        for case in tuning.cases
        for seed in tuning.seeds
    ]
    results = all_of(partial(fly, compiled=True, logging=False), flights, threads=threads)
    periods = [flight.setup.schedule.plant_period for flight in flights]
    costs = [flight_cost(result, tuning.objective, period) for result, period in zip(results, periods, strict=True)]
    return sum(costs) / len(costs)


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
    controller: Controller, tuning: Tuning, storage: Path | None = None, threads: int = 2, progress: bool = False
) -> Tuned:
    """Return the trials of ``controller``, those in ``storage`` (a journal file) not flown again."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    backend = None
    if storage is not None:
        from optuna.storages.journal import JournalFileBackend

        storage.parent.mkdir(parents=True, exist_ok=True)
        backend = optuna.storages.JournalStorage(JournalFileBackend(str(storage)))
    study = optuna.create_study(storage=backend, study_name=controller.name, load_if_exists=True)
    done = _finished(study)
    for count in _counted(range(len(done), tuning.trials), controller.name, progress):
        seed = tuning.sampler_seed * 1_000_003 + count
        study.sampler = optuna.samplers.TPESampler(seed=seed, n_startup_trials=20, multivariate=True)
        values = defaults(controller) if count == 0 else None
        trial = study.ask() if values is None else _fixed(study, values)
        values = {knob.name: _suggest(trial, knob) for knob in controller.knobs}
        study.tell(trial, cost(controller, values, tuning, threads))
    trials = [Trial(number, trial.value, dict(trial.params)) for number, trial in enumerate(_finished(study))]
    return Tuned(controller, trials[: tuning.trials])


def _finished(study: Any) -> list[Any]:
    from optuna.trial import TrialState

    return study.get_trials(states=(TrialState.COMPLETE,))  # type: ignore[no-any-return]


def _fixed(study: Any, values: Mapping[str, float]) -> Any:
    study.enqueue_trial(dict(values))
    return study.ask()


def _suggest(trial: Any, knob: Knob) -> float:
    return float(trial.suggest_float(knob.name, knob.low, knob.high, log=knob.log))


def _counted(numbers: range, name: str, progress: bool) -> Any:
    if not progress:
        return numbers
    from tqdm import tqdm

    return tqdm(numbers, desc=name, unit="trial")


def parameter_file(tuned: Tuned, plan: StudyPlan) -> str:
    """Return the gains of the best trial as a ROS parameter file, with the record of the tuning as comments."""
    best, first = tuned.best, tuned.trials[0]
    tuning, objective = plan.tuning, plan.tuning.objective
    scales = f"position RMSE / {objective.rmse_scale} m + torque variation / {objective.variation_scale} N m/s"
    flights = f"seeds {', '.join(map(str, tuning.seeds))}, {', '.join(tuning.cases)}, {', '.join(tuning.plants)}"
    lines = [
        f"{tuned.controller.title}: gains from scripts/tune {plan.path.name} --only {tuned.controller.name}",
        f"best of {len(tuned.trials)} trials: number {best.number}, cost {best.cost:.4f} (defaults: {first.cost:.4f})",
        f"cost: mean of {scales}",
        f"over {flights}; sampler TPE, seed {tuning.sampler_seed}",
    ]
    if tuning.conditions != ({},):
        lines.append(f"under {len(tuning.conditions)} conditions, see the plan")
    lines += [f"{k.name}: {best.values[k.name]:.6g} in [{k.low}, {k.high}]" for k in tuned.controller.knobs]
    content = {
        f"/**/{node}": {"ros__parameters": values} for node, values in tuned.controller.overrides(best.values).items()
    }
    comments = "".join(f"# {line}\n" for line in lines)
    return comments + str(yaml.safe_dump(content, sort_keys=False))


def trial_table(tuned: Tuned) -> str:
    """Return all trials as CSV: number, cost, one column per knob."""
    text = io.StringIO()
    names = [knob.name for knob in tuned.controller.knobs]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["number", "cost", *names])
    for trial in tuned.trials:
        writer.writerow([trial.number, f"{trial.cost:.6g}", *(f"{trial.values[name]:.6g}" for name in names)])
    return text.getvalue()


def main(arguments: Sequence[str] | None = None) -> int:
    """Tune from the command line: 0 done, 2 usage or set-up."""
    parser = argparse.ArgumentParser(
        prog="tune",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("plan", help="paper, or the path of a plan (as studies/study.yaml)")
    parser.add_argument("--only", action="append", metavar="CONTROLLER", help="may be repeated (default: all)")
    parser.add_argument("--trials", type=int, metavar="N", help="budget of each controller (default: the plan's)")
    parser.add_argument("--sampler-seed", type=int, metavar="N", help="of the search (default: the plan's)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the gains (default: next to the plan)")
    parser.add_argument("--storage", type=Path, metavar="FILE", help="journal of the trials, to go on from")
    parser.add_argument("--threads", type=int, default=2, metavar="N", help="flights at once (default: 2)")
    options = parser.parse_args(arguments)
    try:
        plan = read_plan(find_plan(options.plan))
        chosen = _chosen(plan, options.only)
        plan = plan._replace(tuning=_changed(plan.tuning, options.trials, options.sampler_seed))
        for controller in chosen:
            tuned = tune(controller, plan.tuning, options.storage, options.threads, progress=True)
            target = gains_file(plan, controller.name)
            target = target if options.out is None else options.out / target.name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(parameter_file(tuned, plan), encoding="utf-8")
            target.with_suffix(".csv").write_text(trial_table(tuned), encoding="utf-8")
            best = tuned.best
            sys.stdout.write(f"{controller.name}: cost {best.cost:.4f} at trial {best.number}: {target}\n")
    except (ParameterError, PluginError, EngineError) as error:
        sys.stderr.write(f"tune: {error}\n")
        return 2
    return 0


def _changed(tuning: Tuning, trials: int | None, sampler_seed: int | None) -> Tuning:
    changed = tuning if trials is None else tuning._replace(trials=max(1, trials))
    return changed if sampler_seed is None else changed._replace(sampler_seed=sampler_seed)


def _chosen(plan: StudyPlan, names: Sequence[str] | None) -> list[Controller]:
    known = {controller.name: controller for controller in plan.controllers}
    for name in names or ():
        if name not in known:
            raise ParameterError(f"--only: found {name!r}, expected one of {', '.join(known)}")
    return [known[name] for name in names or known]


if __name__ == "__main__":
    sys.exit(main())
