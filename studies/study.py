"""The comparison of whole controllers on held-out seeds: which files a study leaves behind.

``scripts/study paper --seeds N --out DIR`` flies every tuning of every controller of ``studies/study.yaml`` (a position
law, an attitude law, files of tuned gains) under every condition, on every case, plant and held-out seed, and writes:

``DIR/flights.parquet``
    One row per flight: ``controller``, ``tuning`` (int), ``condition``, ``case``, ``plant`` (text), ``seed`` (int),
    ``outcome`` (``ended``, ``diverged`` or ``refused``), ``steps`` (int, plant steps flown), ``cost`` (that of the
    tuning's objective), ``over_hover``, then one float column per name of
    ``quad_analysis.metrics.METRICS`` (NaN where the metric does not exist or the flight did not end).
``DIR/comparison.parquet``
    One row per ``controller`` and ``condition``: costs over tunings, see ``study_statistics.comparison``.
``DIR/trials.parquet``
    One row per trial: ``controller``, ``tuning``, ``number``, ``cost``, ``rmse`` (m), ``variation`` (N m/s).
``DIR/summary.parquet``
    One row per ``controller``, ``case``, ``plant``, ``condition``, ``metric``: ``flights``, ``ended``, ``median``,
    ``low``, ``high`` (5 and 95 %) over the flights that ended with a number, and against the first controller on the
    same seeds: ``pairs``, ``difference`` (median of this controller minus the first), ``difference_low``,
    ``difference_high`` (bootstrap confidence interval, 95 %); NaN on the first controller's own rows.
``DIR/examples/<controller>-<case>.npz``
    One flight each (first plant, condition, tuning and held-out seed): an array per step topic as in
    ``quad_flight.flight.Result.topics``, key = topic name (``truth``, ``reference``, ``attitude_setpoint``,
    ``wrench_setpoint``, ``actuation``, ``disturbance``, ``position_controller/internals``,
    ``attitude_controller/internals``).
``DIR/study.json``
    ``name``, ``command``, ``created`` (UTC), ``commit``, ``versions``, ``plan`` (hash of its file), ``cases``,
    ``plants``, ``conditions`` and ``tuned_under`` ({name: {node: {parameter: value}}}), ``tunings``, ``seeds`` (held
    out), ``training_seeds``, ``seed_rule``, ``controllers``: {name: ``title``, ``position``, ``attitude``, ``plan``
    (hash of what decides its gains), ``gains`` ({tuning: {node: {parameter: value}}}), ``parameters`` ({node:
    {parameter: value}}, all of both laws, of the first tuning), ``tuning`` ({tuning: its record})}, ``objective``,
    ``metrics``: {name: [unit, meaning]}.
``DIR/tables.md``, ``DIR/costs.tex``, ``DIR/costs.pdf``, ``DIR/front.pdf``
    Costs over tunings and all metrics as Markdown; for a paper the costs as LaTeX and as a figure 88 mm wide, and the
    front of error against effort.
``DIR/conditions/NAME.yaml``
    Each condition as a scenario: ``scripts/fly CASE --scenario FILE --preset GAINS --seed S`` flies it into a bag.
``DIR/parts/*.parquet``
    Rows of ``flights.parquet`` as they were flown; a study that was killed goes on from them.

Controllers are listed in one order everywhere, the proposed one first.
"""

import argparse
import hashlib
import json
import platform
import sys
from collections.abc import Iterator, Sequence
from datetime import datetime, timezone
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from study_figures import cost_figure, tuning_figures
from study_plan import (
    Condition,
    Controller,
    Objective,
    StudyPlan,
    find_plan,
    flight_of,
    gains_file,
    only,
    plan_mark,
    read_plan,
    tuned_overrides,
    tuning_mark,
)
from study_statistics import comparison, summary
from study_table import comparison_rows, latex, tables
from tune import flight_cost

from quad_analysis.metrics import METRICS, FlightMetrics, Metric, flight_metrics
from quad_core.parameters import ParameterError, flatten
from quad_core.plugins import PluginError
from quad_flight.engine import EngineError
from quad_flight.flight import Flight, fly
from quad_flight.many import run_many
from quad_flight_log.errors import FlightLogError
from quad_flight_log.notes import git_commit
from quad_report.drawing import save

FLIGHT_KEYS = ("controller", "tuning", "condition", "case", "plant", "seed", "outcome", "steps")
NUMBERS = {
    "cost": Metric("", "RMSE over rmse_scale plus torque variation per second over variation_scale, as tuned"),
    **METRICS,
    "over_hover": Metric("", "integral of the squared commanded thrust over that of the weight, less 1"),
}
_WIDTH = 88.0  # mm, a column
CHUNK = 10  # flights per file of parts/: what a killed study flies again at most
VERSIONS = ("numpy", "numba", "scipy", "pandas", "pyarrow", "optuna")
EXAMPLES = """examples:
  scripts/study paper --seeds 50 --out flights/paper       fly, compare, write flights/paper/report.html
  scripts/study paper --seeds 50 --out flights/paper       again: goes on where it was stopped
  scripts/study paper --seeds 50 --plant rigid_body --only pid --out flights/part      a part of it
  scripts/study mine.yaml --check            the plan: what is flown under which conditions, which gains there are
  python studies/study_report.py flights/paper       the report alone, from the stored flights
  scripts/tune paper                       tune the controllers first (gains are committed)
"""


class Block(NamedTuple):
    """All seeds of one tuning of a controller under one condition, on one case and plant."""

    controller: str
    tuning: int
    condition: str
    case: str
    plant: str
    flight: Flight


class Part(NamedTuple):
    """Some seeds of a block, flown and stored together."""

    block: Block
    seeds: Sequence[int]


def blocks(plan: StudyPlan) -> Iterator[Block]:
    """Yield what is flown, the controllers side by side, so that a stopped study holds all of them."""
    tunings = range(1, plan.tuning.tunings + 1)
    gains = {(body.name, n): tuned_overrides(plan, body, n) for n in tunings for body in plan.controllers}
    for plant in plan.study.plants:
        for case in plan.study.cases:
            for condition in plan.study.conditions:
                for (name, tuning), overrides in gains.items():
                    flight = flight_of(overrides, case, plant, plan.study.start, condition.overrides)
                    yield Block(name, tuning, condition.name, case, plant, flight)


def restricted(plan: StudyPlan, plants: Sequence[str]) -> StudyPlan:
    """Return ``plan`` with only these of its plants, all if none is named. Raises ParameterError for another one."""
    for name in plants:
        if name not in plan.study.plants:
            raise ParameterError(f"--plant: found {name!r}, expected one of {', '.join(plan.study.plants)}")
    return plan._replace(study=plan.study._replace(plants=tuple(plants) or plan.study.plants))


def identity(plan: StudyPlan) -> str:
    """Return a hash of the plan and of all gains: flights of another are not mixed in."""
    digest = hashlib.sha256(plan_mark(plan).encode())
    for controller in plan.controllers:
        for tuning in range(1, plan.tuning.tunings + 1):
            digest.update(gains_file(plan, controller.name, tuning).read_bytes())
    return digest.hexdigest()[:16]


def check_text(plan: StudyPlan) -> str:
    """Return the plan as text: its hash, budget, conditions, and which of the gains are there."""
    tuning, study = plan.tuning, plan.study
    there = {
        body.name: sum(gains_file(plan, body.name, n).is_file() for n in range(1, tuning.tunings + 1))
        for body in plan.controllers
    }
    lines = [
        f"{plan.path}: plan {plan_mark(plan)}",
        f"tuned: {tuning.tunings} times {tuning.trials} trials, seeds {', '.join(map(str, tuning.seeds))}",
        conditions_text(tuning.conditions, study.conditions),
        *(f"{name}: {count} of {tuning.tunings} tunings in {plan.gains}" for name, count in there.items()),
    ]
    return "\n".join(lines) + "\n"


def conditions_text(tuned: Sequence[Condition], flown: Sequence[Condition]) -> str:
    """Return under which conditions gains were found and are compared, and which of those they were not tuned for."""
    known = [each.overrides for each in tuned]
    strange = [each.name for each in flown if each.overrides not in known]
    apart = f"; NOT tuned for: {', '.join(strange)}" if strange else ""
    return f"tuned under {_names(tuned)}; flown under {_names(flown)}{apart}"


def _names(conditions: Sequence[Condition]) -> str:
    return ", ".join(each.name for each in conditions)


def run(plan: StudyPlan, seeds: int, out: Path, command: str, threads: int = 2, progress: bool = False) -> None:
    """Fly the study of ``seeds`` held-out seeds into ``out`` and write all its files but the report.

    Raises ParameterError if ``out`` holds another study, EngineError as ``fly``.
    """
    import pandas

    every = list(blocks(plan))
    _claim(out, identity(plan))
    chosen = plan.study.seeds(seeds)
    bar = _bar(len(every) * len(chosen)) if progress else None
    parts = [Part(block, chosen[first : first + CHUNK]) for block in every for first in range(0, len(chosen), CHUNK)]
    missing = [part for part in parts if not _path(out, part).is_file()]
    for place, table in run_many(partial(_flown, plan.tuning.objective), missing, threads=threads):
        _write_table(table, _path(out, missing[place]))
        if bar is not None:
            bar.update(len(table))
    flights = pandas.concat([pandas.read_parquet(_path(out, part)) for part in parts], ignore_index=True)
    _write_table(flights, out / "flights.parquet")
    names = [controller.name for controller in plan.controllers]
    study = plan.study
    _write_table(summary(flights, names, list(NUMBERS), study.resamples, study.bootstrap_seed), out / "summary.parquet")
    costs, tried = comparison(flights, names), trials(plan)
    _write_table(costs, out / "comparison.parquet")
    _write_table(tried, out / "trials.parquet")
    for block in every:
        if (block.plant, block.condition, block.tuning) == (study.plants[0], study.conditions[0].name, 1):
            _example(out, block, chosen[0])
    about = facts(plan, chosen, every, command)
    same = alike(flights)
    if same:
        about["conditions_text"] += f"; nothing random, every seed flies alike: {', '.join(same)}"
    _write_text(json.dumps(about, indent=1), out / "study.json")
    _write_text(tables(out), out / "tables.md")
    _write_text(latex(comparison_rows(about, costs)), out / "costs.tex")
    titles = {controller.name: controller.title for controller in plan.controllers}
    for figure in (cost_figure(flights, titles), *tuning_figures(tried, titles)):
        if figure.key != "plateau":  # which is for whoever tunes
            save(figure, out / f"{figure.key}.pdf", _WIDTH)
    for condition in study.conditions:
        _write_text(scenario(condition), out / "conditions" / f"{condition.name}.yaml")
    if bar is not None:
        bar.close()


def scenario(condition: Condition) -> str:
    """Return a condition as a parameter file, which ``scripts/fly --scenario`` takes."""
    content = {
        name if name == "/**" else f"/**/{name}": {"ros__parameters": dict(values)}
        for name, values in condition.overrides.items()
    }
    return str(yaml.safe_dump(content, sort_keys=False))


def alike(flights: Any) -> list[str]:
    """Return the conditions in which several seeds are the same flight, so that intervals over seeds say nothing."""
    blocks = ["controller", "tuning", "case", "plant"]
    return [
        str(condition)
        for condition, own in flights.groupby("condition", sort=False)
        if own["seed"].nunique() > 1 and own.groupby(blocks)["cost"].nunique().max() == 1
    ]


def trials(plan: StudyPlan) -> Any:
    """Return the trials of all tunings as one table, from the files beside the gains, as far as they are there."""
    import pandas

    columns = ["number", "cost", "rmse", "variation"]
    found = [pandas.DataFrame(columns=["controller", "tuning", *columns])]
    for body in plan.controllers:
        for tuning in range(1, plan.tuning.tunings + 1):
            path = gains_file(plan, body.name, tuning).with_suffix(".csv")
            if path.is_file():
                table = pandas.read_csv(path).reindex(columns=columns)
                found.append(table.assign(controller=body.name, tuning=tuning))
    return pandas.concat(found[1:] or found, ignore_index=True)


def facts(plan: StudyPlan, seeds: Sequence[int], every: Sequence[Block], command: str) -> dict[str, Any]:
    """Return study.json."""
    objective = plan.tuning.objective
    first = {block.controller: block.flight for block in reversed(every)}
    return {
        "name": plan.name,
        "command": command,
        "plan": plan_mark(plan),
        "created": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "commit": git_commit(Path(__file__).resolve().parent),
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in VERSIONS}},
        "cases": list(plan.study.cases),
        "plants": list(plan.study.plants),
        "conditions": dict(plan.study.conditions),
        "tuned_under": dict(plan.tuning.conditions),
        "conditions_text": conditions_text(plan.tuning.conditions, plan.study.conditions),
        "tunings": plan.tuning.tunings,
        "seeds": list(seeds),
        "training_seeds": list(plan.tuning.seeds),
        "seed_rule": f"{plan.study.held_out_first}, {plan.study.held_out_first + 1}, ... as fixed in {plan.path.name}",
        "controllers": {
            controller.name: _about(plan, controller, first[controller.name]) for controller in plan.controllers
        },
        "objective": f"mean over the training flights of position RMSE / {objective.rmse_scale} m"
        f" + torque variation / {objective.variation_scale} N m/s; a flight that fails: {objective.failure} and more",
        "metrics": {name: list(about) for name, about in NUMBERS.items()},
    }


def _about(plan: StudyPlan, controller: Controller, flight: Flight) -> dict[str, Any]:
    nodes = ("position_controller", "attitude_controller")
    parameters = {node: flatten(flight.resolved[node].plugins["law"].parameters) for node in nodes}
    gains, records = {}, {}
    for tuning in range(1, plan.tuning.tunings + 1):
        text = gains_file(plan, controller.name, tuning).read_text(encoding="utf-8")
        records[tuning] = [line[2:] for line in text.splitlines() if line.startswith("# ")]
        gains[tuning] = tuned_overrides(plan, controller, tuning)
    return {
        "title": controller.title,
        "position": controller.position,
        "attitude": controller.attitude,
        "plan": tuning_mark(plan, controller),
        "gains": gains,
        "parameters": parameters,
        "tuning": records,
    }


def _path(out: Path, part: Part) -> Path:
    block, seeds = part
    words = (*block[:-1], seeds[0], len(seeds))
    return out / "parts" / f"{'-'.join(map(str, words))}.parquet"


def _flown(objective: Objective, part: Part) -> Any:
    """Fly a part; returns its rows as a table."""
    import pandas

    rows = [_row(part.block, seed, objective) for seed in part.seeds]
    table = pandas.DataFrame(rows, columns=[*FLIGHT_KEYS, *NUMBERS])
    table[list(NUMBERS)] = table[list(NUMBERS)].astype(float)
    return table


def _row(block: Block, seed: int, objective: Objective) -> list[Any]:
    result = fly(block.flight._replace(seed=seed), compiled=True)
    values = flight_metrics(result.topics) if result.outcome == "ended" else FlightMetrics()
    vehicle, over_hover = block.flight.setup.vehicle, None
    if values.thrust_effort and values.duration:
        over_hover = values.thrust_effort / (values.duration * (vehicle.mass * vehicle.gravity) ** 2) - 1.0
    costs = flight_cost(result, objective, block.flight.setup.schedule.plant_period)
    return [*block[:-1], seed, result.outcome, result.steps, costs.cost, *values, over_hover]


def _example(out: Path, block: Block, seed: int) -> None:
    path = out / "examples" / f"{block.controller}-{block.case}.npz"
    if path.is_file():
        return
    flown = fly(block.flight._replace(seed=seed), compiled=True).topics
    topics: dict[str, Any] = {name: rows for name, rows in flown.items() if name != "state"}
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".part.npz")
    np.savez_compressed(partial, **topics)
    partial.replace(path)


def _claim(out: Path, mark: str) -> None:
    """Note whose flights ``out`` holds; raises ParameterError if they are another study's."""
    path = out / "parts" / "identity"
    if path.is_file():
        found = path.read_text(encoding="utf-8").strip()
        if found != mark:
            raise ParameterError(f"--out: {out} holds flights of another plan or other gains ({found}, this is {mark})")
    else:
        _write_text(mark + "\n", path)


def _write_table(table: Any, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".part")
    table.to_parquet(partial, index=False)
    partial.replace(path)


def _write_text(text: str, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)


def _bar(total: int) -> Any:
    from tqdm import tqdm

    return tqdm(total=total, unit="flight")


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a study from the command line: 0 done, 1 the report cannot be written, 2 usage or set-up."""
    parser = argparse.ArgumentParser(
        prog="scripts/study",
        description="Fly all controllers of a plan on held-out seeds, compare them and write a report.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("plan", help="paper, or the path of a plan (as studies/study.yaml)")
    parser.add_argument("--check", action="store_true", help="say what the plan holds, and fly nothing")
    parser.add_argument("--seeds", type=int, default=50, metavar="N", help="held-out seeds (default: 50)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where all files of the study go")
    parser.add_argument("--gains", type=Path, metavar="DIR", help="folder of the tunings (default: PLAN_gains)")
    parser.add_argument("--only", action="append", metavar="CONTROLLER", help="may be repeated (default: all)")
    parser.add_argument(
        "--plant", action="append", metavar="NAME", help="fly only this plant of the plan; may be repeated"
    )
    parser.add_argument("--threads", type=int, default=2, metavar="N", help="flights at once (default: 2)")
    options = parser.parse_args(arguments)
    if options.seeds < 1 or options.threads < 1:
        parser.error("--seeds and --threads: expected at least 1")
    if options.out is None and not options.check:
        parser.error("--out: found nothing, expected the folder of the study")
    parts = "".join(f" --{name} {each}" for name in ("only", "plant") for each in getattr(options, name) or ())
    command = f"scripts/study {options.plan} --seeds {options.seeds}{parts} --out {options.out}"
    try:
        plan = only(restricted(read_plan(find_plan(options.plan)), options.plant or ()), options.only or ())
        plan = plan._replace(gains=options.gains or plan.gains)
        if options.check:
            sys.stdout.write(check_text(plan))
            return 0
        sys.stderr.write(f"study: {conditions_text(plan.tuning.conditions, plan.study.conditions)}\n")
        run(plan, options.seeds, options.out, command, options.threads, progress=True)
    except (ParameterError, PluginError, EngineError) as error:
        sys.stderr.write(f"study: {error}\n")
        return 2
    try:
        from study_report import write_report

        path = write_report(options.out, command)
    except (FlightLogError, OSError) as error:
        sys.stderr.write(f"study: flights are stored, but no report: {error}\n")
        return 1
    sys.stdout.write(f"{path}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
