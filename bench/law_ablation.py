"""What each addition to the paper's laws is worth, and the smallest set with which the paper's cases fly.

  worth     takes the additions out of a preset one at a time (`flying`: Table 2 and all additions but those that only
            serve accuracy): RMSE of both cases flown onto the curve, and the largest error after 20 s from the origin,
            from 50 m off, and after 30 s from 50 m off with 1.5 m g and sd 1.5 m/s^2 (`crash`: a seed did not reach the
            end)
  smallest  adds them to `printed` in all combinations of 0, 1, 2, ... until some fly both cases from the origin with
            every thrust named: never above 0.25 m after 20 s

Examples:
  python bench/law_ablation.py worth --preset minimal
  python bench/law_ablation.py smallest --thrust 2 3 4
"""

import argparse
import itertools
import sys

from law_additions import FLYING, held_by, printed_with, without
from paper_flight import CASES, FIRST_POINT, PaperCase, paper_flight, worst_rmse
from tqdm import tqdm

from quad_flight.many import sweep

LIMIT = 0.25
LARGEST_SET = 4
HARD = {"vehicle": {"thrust_to_weight": 1.5}, "disturbance": {"acceleration_sd": 1.5}}
FAR = ((0.0, 0.0, -50.0), (0.0, 50.0, 0.0), (0.0, 0.0, 50.0))


def main():
    """Run what the command line asks for; returns the exit code."""
    options = arguments()
    if options.what == "worth":
        worth(options.preset, range(1, options.seeds + 1), options.thrust[0])
    else:
        smallest(range(1, options.seeds + 1), options.thrust)
    return 0


def arguments():
    """Return the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("worth", "smallest"))
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--preset", default="tuned", choices=("tuned", "minimal", "flying"))
    parser.add_argument("--thrust", type=float, nargs="+", default=[3.0], help="largest thrust of the vehicle in m g")
    return parser.parse_args()


def worth(preset, seeds, thrust):
    """Print one row per addition taken out of ``preset``."""
    print(f"preset {preset}, seeds 1..{len(seeds)}, thrust {thrust:g} m g; worst seed, m")
    columns = [*(f"RMSE {case}" for case in CASES), "from the origin", "from 50 m off", "the same, weak and gusty"]
    print(f"| without | {' | '.join(columns)} |\n|---|" + "---|" * len(columns))
    for addition in tqdm((None, *held_by(preset)), disable=None):
        paper_cases = [PaperCase(case, preset, vehicle={"thrust_to_weight": thrust}) for case in CASES]
        if preset == "flying":
            paper_cases = [printed_with(one, FLYING) for one in paper_cases]
        if addition:
            paper_cases = [without(one, addition) for one in paper_cases]
        errors = [worst_rmse(one, seeds) for one in paper_cases]
        origin = [late(one._replace(start="printed"), seeds) for one in paper_cases]
        far = [late(one, seeds) for each in paper_cases for one in from_afar(each)]
        hard = [late(one._replace(**HARD), seeds, 30.0) for each in paper_cases for one in from_afar(each)]
        cells = [shown(value) for value in (*errors, max(origin), max(far), max(hard))]
        print(f"| {addition.name if addition else 'nothing: the preset'} | {' | '.join(cells)} |", flush=True)


def from_afar(paper_case):
    """Yield the flights of ``paper_case`` from 50 m below, beside and above the first point."""
    for offset in FAR:
        begin = tuple(p + d for p, d in zip(FIRST_POINT[paper_case.case], offset, strict=True))
        yield paper_case._replace(start="printed", initial=begin)


def late(paper_case, seeds, after=20.0):
    """Return the largest error after ``after`` s in m, infinite if a seed did not reach the end."""
    results = sweep(paper_flight(paper_case, after), seeds)
    return max(one.score.largest_error if one.outcome == "ended" else float("inf") for one in results)


def shown(value):
    """Return a cell of the table."""
    if value == float("inf"):
        return "crash"
    return f"**{value:.1f}**" if value > 1.0 else f"{value:.3f}"


def smallest(seeds, thrusts):
    """Print the smallest sets of additions that fly at all thrusts, and whether they also come back from 50 m off."""
    print(
        f"printed, seeds 1..{len(seeds)}, thrusts {', '.join(f'{t:g}' for t in thrusts)} m g; largest error after 20 s"
    )
    paper_cases = [PaperCase(case, start="printed", vehicle={"thrust_to_weight": t}) for t in thrusts for case in CASES]
    far = [away for one in paper_cases for away in from_afar(one)]
    print("| additions | from the origin | from 50 m off |\n|---|---|---|")
    for size in range(LARGEST_SET + 1):
        sets = list(itertools.combinations(FLYING, size))
        flying = 0
        for chosen in tqdm(sets, desc=f"{size} additions", disable=None):
            worst = worst_of(paper_cases, chosen, seeds)
            if worst <= LIMIT:
                flying += 1
                cells = (" + ".join(one.name for one in chosen), shown(worst), shown(worst_of(far, chosen, seeds[:2])))
                print(f"| {' | '.join(cells)} |", flush=True)
        print(f"{size} additions: {flying} of {len(sets)} sets fly", flush=True)
        if flying:
            return


def worst_of(flights, chosen, seeds):
    """Return the largest error of ``flights`` with the ``chosen`` additions, or that of the first that fails."""
    worst = 0.0
    for some in (seeds[:1], seeds[1:]):
        for paper_case in flights if some else ():
            worst = max(worst, late(printed_with(paper_case, chosen), some))
            if worst > LIMIT:
                return worst
    return worst


if __name__ == "__main__":
    sys.exit(main())
