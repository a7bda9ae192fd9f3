"""The comparison of whole controllers on held-out seeds: which files a study leaves behind.

``scripts/study paper --seeds N --out DIR`` flies every controller of ``config/study.yaml`` (a position law, an attitude
law, a file of tuned gains) on every case, plant and held-out seed, and writes:

``DIR/flights.parquet``
    One row per flight: ``controller``, ``case``, ``plant`` (text), ``seed`` (int), ``outcome`` (``ended``,
    ``diverged`` or ``refused``), ``steps`` (int, plant steps flown), then one float column per name of
    ``quad_flight_log.analysis.metrics.METRICS`` (NaN where the metric does not exist or the flight did not end).
``DIR/summary.parquet``
    One row per ``controller``, ``case``, ``plant``, ``metric``: ``flights``, ``ended``, ``median``, ``low``, ``high``
    (5 and 95 %) over the seeds that ended with a number, and against the first controller on the same seeds:
    ``pairs``, ``difference`` (median of this controller minus the first), ``difference_low``, ``difference_high``
    (bootstrap confidence interval, 95 %); NaN on the first controller's own rows.
``DIR/examples/<controller>-<case>.npz``
    One flight each (plant ``rigid_body``, first held-out seed): an array per step topic as in
    ``quad_flight.flight.Result.topics``, key = topic name (``truth``, ``reference``, ``attitude_setpoint``,
    ``wrench_setpoint``, ``actuation``, ``disturbance``, ``position_controller/internals``,
    ``attitude_controller/internals``).
``DIR/study.json``
    ``name``, ``command``, ``created`` (UTC), ``commit``, ``versions``, ``cases``, ``plants``, ``seeds`` (held out),
    ``training_seeds``, ``seed_rule``, ``controllers``: {name: ``title``, ``position``, ``attitude``, ``gains`` ({node:
    {parameter: value}} as tuned), ``parameters`` ({node: {parameter: value}}, all of both laws),
    ``tuning`` (record of the tuning)}, ``objective``, ``metrics``: {name: [unit, meaning]}.
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
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from study_plan import (
    Controller,
    Overrides,
    StudyPlan,
    find_plan,
    flight_of,
    gains_file,
    read_plan,
    tuned_overrides,
)
from study_statistics import summary

from quad_core.parameters import ParameterError, flatten
from quad_core.plugins import PluginError
from quad_flight.engine import EngineError
from quad_flight.flight import Flight, fly
from quad_flight.many import run_many
from quad_flight_log.analysis.metrics import METRICS, flight_metrics
from quad_flight_log.errors import FlightLogError
from quad_flight_log.recorder.provenance import git_commit

FLIGHT_KEYS = ("controller", "case", "plant", "seed", "outcome", "steps")
CHUNK = 10  # flights per file of parts/: what a killed study flies again at most
VERSIONS = ("numpy", "numba", "scipy", "pandas", "pyarrow", "optuna")
EXAMPLES = """examples:
  scripts/study paper --seeds 50 --out flights/paper       fly, compare, write flights/paper/report.html
  scripts/study paper --seeds 50 --out flights/paper       again: goes on where it was stopped
  scripts/study paper --seeds 50 --plant rigid_body --out flights/paper      a part of it
  python studies/study_report.py flights/paper       the report alone, from the stored flights
  scripts/tune paper                       tune the controllers first (gains are committed)
"""


class Block(NamedTuple):
    """All seeds of one controller on one case and plant."""

    controller: str
    case: str
    plant: str
    flight: Flight


class Part(NamedTuple):
    """Some seeds of a block, flown and stored together."""

    block: Block
    seeds: Sequence[int]


def blocks(plan: StudyPlan) -> Iterator[Block]:
    """Yield what is flown, the controllers side by side, so that a stopped study holds all of them."""
    gains = {controller.name: tuned_overrides(plan, controller) for controller in plan.controllers}
    for plant in plan.study.plants:
        for case in plan.study.cases:
            for name, overrides in gains.items():
                yield Block(name, case, plant, flight_of(overrides, case, plant, plan.study.start))


def restricted(plan: StudyPlan, plants: Sequence[str]) -> StudyPlan:
    """Return ``plan`` with only these of its plants, all if none is named. Raises ParameterError for another one."""
    for name in plants:
        if name not in plan.study.plants:
            raise ParameterError(f"--plant: found {name!r}, expected one of {', '.join(plan.study.plants)}")
    return plan._replace(study=plan.study._replace(plants=tuple(plants) or plan.study.plants))


def identity(plan: StudyPlan) -> str:
    """Return a hash of the plan and of all gains: flights of another are not mixed in."""
    digest = hashlib.sha256(plan.path.read_bytes())
    for controller in plan.controllers:
        digest.update(gains_file(plan, controller.name).read_bytes())
    return digest.hexdigest()[:16]


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
    for place, table in run_many(_flown, missing, threads=threads):
        _write_table(table, _path(out, missing[place]))
        if bar is not None:
            bar.update(len(table))
    flights = pandas.concat([pandas.read_parquet(_path(out, part)) for part in parts], ignore_index=True)
    _write_table(flights, out / "flights.parquet")
    names = [controller.name for controller in plan.controllers]
    study = plan.study
    _write_table(summary(flights, names, list(METRICS), study.resamples, study.bootstrap_seed), out / "summary.parquet")
    for block in every:
        if block.plant == study.plants[0]:
            _example(out, block, chosen[0])
    _write_text(json.dumps(facts(plan, chosen, every, command), indent=1), out / "study.json")
    if bar is not None:
        bar.close()


def facts(plan: StudyPlan, seeds: Sequence[int], every: Sequence[Block], command: str) -> dict[str, Any]:
    """Return study.json."""
    objective = plan.tuning.objective
    first = {block.controller: block.flight for block in reversed(every)}
    return {
        "name": plan.name,
        "command": command,
        "created": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "commit": git_commit(Path(__file__).resolve().parent),
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in VERSIONS}},
        "cases": list(plan.study.cases),
        "plants": list(plan.study.plants),
        "seeds": list(seeds),
        "training_seeds": list(plan.tuning.seeds),
        "seed_rule": f"{plan.study.held_out_first}, {plan.study.held_out_first + 1}, ... as fixed in {plan.path.name}",
        "controllers": {
            controller.name: _about(plan, controller, first[controller.name]) for controller in plan.controllers
        },
        "objective": f"mean over the training flights of position RMSE / {objective.rmse_scale} m"
        f" + torque variation / {objective.variation_scale} N m/s; a flight that fails: {objective.failure} and more",
        "metrics": {name: list(about) for name, about in METRICS.items()},
    }


def _about(plan: StudyPlan, controller: Controller, flight: Flight) -> dict[str, Any]:
    path = gains_file(plan, controller.name)
    comments = [line[2:] for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("# ")]
    gains: Overrides = tuned_overrides(plan, controller)
    nodes = ("position_controller", "attitude_controller")
    parameters = {node: flatten(flight.resolved[node].plugins["law"].parameters) for node in nodes}
    return {
        "title": controller.title,
        "position": controller.position,
        "attitude": controller.attitude,
        "gains": gains,
        "parameters": parameters,
        "tuning": comments,
    }


def _path(out: Path, part: Part) -> Path:
    block, seeds = part
    return out / "parts" / f"{block.controller}-{block.case}-{block.plant}-{seeds[0]}-{len(seeds)}.parquet"


def _flown(part: Part) -> Any:
    """Fly a part; returns its rows as a table."""
    import pandas

    table = pandas.DataFrame([_row(part.block, seed) for seed in part.seeds], columns=[*FLIGHT_KEYS, *METRICS])
    table[list(METRICS)] = table[list(METRICS)].astype(float)
    return table


def _row(block: Block, seed: int) -> list[Any]:
    result = fly(block.flight._replace(seed=seed), compiled=True)
    values = flight_metrics(result.topics) if result.outcome == "ended" else (None,) * len(METRICS)
    return [block.controller, block.case, block.plant, seed, result.outcome, result.steps, *values]


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
    parser.add_argument("--seeds", type=int, default=50, metavar="N", help="held-out seeds (default: 50)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="where all files of the study go")
    parser.add_argument(
        "--plant", action="append", metavar="NAME", help="fly only this plant of the plan; may be repeated"
    )
    parser.add_argument("--threads", type=int, default=2, metavar="N", help="flights at once (default: 2)")
    options = parser.parse_args(arguments)
    if options.seeds < 1 or options.threads < 1:
        parser.error("--seeds and --threads: expected at least 1")
    only = "".join(f" --plant {name}" for name in options.plant or ())
    command = f"scripts/study {options.plan} --seeds {options.seeds}{only} --out {options.out}"
    try:
        plan = restricted(read_plan(find_plan(options.plan)), options.plant or ())
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
