"""Which law costs least over the luck of the tuner: held-out flights of several tunings of each controller of a plan.

DIR holds one folder per seed of the sampler, as this wrote it:
  scripts/tune PLAN --sampler-seed N --out DIR/N

Each tuning is flown on the held-out seeds under every condition of the plan; its cost is that of the plan's objective.
The interval of a ratio is that of Welch's t on the logarithms of the costs of the tunings: the flights are the same for
all, so it says what another seed of the tuner would change, not what other flights would.

Examples:
  python bench/law_tunings.py studies/real_x500.yaml
  python bench/law_tunings.py PLAN --gains studies/mine --seeds 50 --against aibs-pid
"""

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t, ttest_ind

from quad_core.parameter_files import read_parameter_file
from quad_flight.flight import fly

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "studies"))
from study_plan import flight_of, read_plan
from tune import flight_cost

LOST = 0.3


class Flown(NamedTuple):
    """One tuning on the held-out flights: mean cost, medians of RMSE in m and torque variation in N m, flights lost."""

    cost: float
    rmse: float
    variation: float
    worst: float
    lost: int


def flown(plan, gains, seeds, threads):
    """Return how the tuning of the parameter file ``gains`` flies the held-out seeds under all conditions."""
    overrides = {pattern.strip("/*"): values for pattern, values in read_parameter_file(gains).items()}
    flights = [
        flight_of(overrides, case, plant, condition=condition)._replace(seed=seed)
        for condition in plan.tuning.conditions
        for plant in plan.tuning.plants
        for case in plan.tuning.cases
        for seed in plan.study.seeds(seeds)
    ]
    fly(flights[0], compiled=True, logging=False)
    with ThreadPoolExecutor(threads) as pool:
        results = list(pool.map(lambda flight: fly(flight, compiled=True, logging=False), flights))
    objective, period = plan.tuning.objective, flights[0].setup.schedule.plant_period
    good = [one for one in results if one.outcome == "ended" and one.score.largest_error <= LOST]
    rmse = [one.rmse for one in good] or [float("nan")]
    variation = [one.score.torque_variation for one in good] or [float("nan")]
    costs = [flight_cost(one, objective, period) for one in results]
    return Flown(np.mean(costs), np.median(rmse), np.median(variation), np.max(rmse), len(results) - len(good))


def interval(costs):
    """Return mean and 95 % interval of the mean of ``costs`` over tunings, as text."""
    mean = np.mean(costs)
    if len(costs) < 2:
        return f"{mean:.3f}"
    half = t.ppf(0.975, len(costs) - 1) * np.std(costs, ddof=1) / np.sqrt(len(costs))
    return f"{mean:.3f} ({mean - half:.3f} to {mean + half:.3f})"


def ratio(ours, theirs):
    """Return the ratio of the geometric means of the costs less 1 in %, with its 95 % interval, as text."""
    test = ttest_ind(np.log(ours), np.log(theirs), equal_var=False)
    low, high = test.confidence_interval(0.95)
    middle = np.mean(np.log(ours)) - np.mean(np.log(theirs))
    return " to ".join(f"{100 * np.expm1(x):+.1f}" for x in (low, high)).join(
        (f"{100 * np.expm1(middle):+.1f} % (", ")")
    )


def main():
    """Fly what stands in the folder of gains and print one row per tuning, then one per controller."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan", type=Path, help="plan of scripts/tune")
    parser.add_argument("--gains", type=Path, metavar="DIR", help="tunings (default: PLAN's folder _gains)")
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="held-out seeds (default: 20)")
    parser.add_argument("--against", metavar="NAME", help="controller of the ratios (default: the plan's first)")
    parser.add_argument("--threads", type=int, default=2, metavar="N", help="flights at once (default: 2)")
    options = parser.parse_args()
    plan = read_plan(options.plan)
    folder = options.gains or options.plan.parent / f"{options.plan.stem}_gains"
    print("| controller | sampler seed | held-out cost | RMSE | worst | torque variation | lost |")
    print("|---|---|---|---|---|---|---|")
    found: dict[str, list[Any]] = {}
    for controller in plan.controllers:
        for gains in sorted(folder.glob(f"*/{controller.name}.yaml")):
            one = flown(plan, gains, options.seeds, options.threads)
            found.setdefault(controller.name, []).append(one)
            cells = f"{one.cost:.3f} | {1e3 * one.rmse:.1f} mm | {1e3 * one.worst:.1f} mm | {one.variation:.1f} N m"
            print(f"| {controller.title} | {gains.parent.name} | {cells} | {one.lost} |", flush=True)
    first = options.against or plan.controllers[0].name
    print(f"\n| controller | tunings | cost over tunings (95 %) | beside {first} | lost |\n|---|---|---|---|---|")
    for name, tunings in found.items():
        costs = [one.cost for one in tunings]
        beside = ratio(costs, [one.cost for one in found[first]]) if name != first and len(costs) > 1 else ""
        lost = sum(one.lost for one in tunings)
        print(f"| {name} | {len(costs)} | {interval(costs)} | {beside} | {lost} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
