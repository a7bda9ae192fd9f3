"""Whether a plan's budget of trials was enough: tunings with more trials, judged on held-out seeds.

``python studies/plateau.py PLAN LONGER`` reads the trials of each tuning in LONGER, a folder of gains that scripts/tune
made from the same plan with more trials. The sampler is the same, so the first of them are the plan's own. A row per
controller compares the best of the plan's trials with the best of all, on the training flights and on held-out seeds
under the conditions of the tuning. ``--out`` draws the best cost over trials.

Example:
  sed 's/trials: 120/trials: 240/' studies/laws_x500.yaml > longer.yaml
  scripts/tune longer.yaml --tuning 1 --tuning 2
  python studies/plateau.py studies/laws_x500.yaml longer_gains --seeds 5 --out plateau.png
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from study_plan import Controller, StudyPlan, find_plan, read_plan
from tune import cost

from quad_core.parameters import ParameterError
from quad_core.plugins import PluginError
from quad_flight.engine import EngineError

HEAD = (
    "controller", "tunings", "the last quarter of the plan's trials took", "the trials after it took",
    "of them the second half", "held out, plan's trials", "held out, all trials", "change, held out",
)  # fmt: skip


def trials(folder: Path, controller: Controller) -> dict[int, Any]:
    """Return {tuning: all its trials as a table, a column per knob}. Raises ParameterError if there is none."""
    import pandas

    paths = sorted(folder.glob(f"*/{controller.name}.csv"), key=lambda path: int(path.parent.name))
    if not paths:
        raise ParameterError(f"{folder}: found no N/{controller.name}.csv, expected the trials of its tunings")
    return {int(path.parent.name): pandas.read_csv(path) for path in paths}


def best_costs(table: Any) -> NDArray[np.float64]:
    """Return the cheapest cost up to each trial, shape (trials,)."""
    return np.minimum.accumulate(table["cost"].to_numpy(float))


def fell(best: NDArray[np.float64], first: int, last: int) -> float:
    """Return the share by which the best cost fell from trial number ``first`` to number ``last``, counted from 1."""
    return float(1.0 - best[last - 1] / best[first - 1])


def values_of_best(table: Any, controller: Controller, count: int) -> Mapping[str, float]:
    """Return {knob: value} of the cheapest of the first ``count`` trials, the first of equals."""
    row = table.iloc[int(table["cost"].iloc[:count].idxmin())]
    return {knob.name: float(row[knob.name]) for knob in controller.knobs}


def row(plan: StudyPlan, controller: Controller, tables: Mapping[int, Any], seeds: Sequence[int]) -> list[str]:
    """Return the cells of a controller. Medians over its tunings; raises EngineError as ``tune.cost``."""
    held_out = plan.tuning._replace(seeds=tuple(seeds))
    count = plan.tuning.trials
    shares, costs = [], []
    for table in tables.values():
        best, end = best_costs(table), len(table)
        shares.append([fell(best, 3 * count // 4, count), fell(best, count, end), fell(best, (count + end) // 2, end)])
        costs.append([cost(controller, values_of_best(table, controller, n), held_out).cost for n in (count, end)])
    taken, (before, after) = np.median(shares, axis=0), np.median(costs, axis=0)
    change = np.median([late / early - 1.0 for early, late in costs])
    cells = [f"{100.0 * share:.1f} %" for share in taken]
    return [controller.title, str(len(tables)), *cells, f"{before:.2f}", f"{after:.2f}", f"{100.0 * change:+.1f} %"]


def draw(curves: Mapping[str, NDArray[np.float64]], count: int, path: Path) -> None:
    """Draw {title: best costs over trials, shape (tunings, trials)}, medians over those at trial ``count``."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    for place, (title, best) in enumerate(curves.items()):
        shape = best / best[:, count - 1 : count]
        numbers = np.arange(1, best.shape[1] + 1)
        axes.plot(
            numbers, np.median(shape, axis=0), label=title, color=f"C{place % 10}", ls="-" if place < 10 else "--"
        )
    axes.axvline(count, color="0.6", lw=0.8)
    axes.set(xlabel="trials", ylabel=f"best cost / best of {count}", ylim=(0.8, 1.6), xlim=(1, None))
    axes.legend(fontsize=7, ncols=2)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _show(cells: Sequence[str]) -> None:
    sys.stdout.write(f"| {' | '.join(cells)} |\n")
    sys.stdout.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table and, with ``--out``, draw the figure: 0 done, 2 usage or set-up."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan", help="path of a plan")
    parser.add_argument("longer", type=Path, help="folder of gains with more trials")
    parser.add_argument("--seeds", type=int, default=5, metavar="N", help="held-out seeds (default: 5)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="a picture of the best cost over trials")
    options = parser.parse_args(arguments)
    curves = {}
    try:
        plan = read_plan(find_plan(options.plan))
        _show(HEAD)
        _show(["---"] * len(HEAD))
        for controller in plan.controllers:
            tables = trials(options.longer, controller)
            _show(row(plan, controller, tables, plan.study.seeds(options.seeds)))
            curves[controller.title] = np.array([best_costs(table) for table in tables.values()])
    except (ParameterError, PluginError, EngineError) as error:
        sys.stderr.write(f"plateau: {error}\n")
        return 2
    if options.out:
        draw(curves, plan.tuning.trials, options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
