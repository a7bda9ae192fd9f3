"""Margins of pairs of laws as numbers, by bisection: Case 2, its first 20 s, plant rigid_body, preset tuned, seed 1.

A flight counts as good if it ends, its largest error is at most 1 m and its torque variation at most 10 x nominal.

  table   delay without prediction and predicted, rotor lag, torque up and down, thrust down, mass
  linear  the same, as far as a hover has them, of the linearised loop: stable or not, without noise or curve
  why     what every pair fails of where rotors give 40 % less: the same flights with the shared limits raised
  cross   RMSE and torque variation over seeds 1001 to 1010: ideal; and 10 ms predicted, noise and rotor lag of 30 ms

Examples:
  python bench/law_margins.py table
  python bench/law_margins.py table --pair aibs+abfnitsm --pair pid+pid
  python bench/law_margins.py why cross
"""

import argparse
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from law_prediction import LAG, NOISE, WITHOUT, predicting

from quad_flight.flight import fly, from_names

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "studies"))
from linearised import STABLE, hover, largest

PAIRS = (
    "aibs+abfnitsm",
    "aibs+abfnitsm_so3",
    "aibs+indi",
    "aibs+pid",
    "aibs+se3",
    "ibs+itsm",
    "pid+pid",
    "se3+se3",
    "geometric_pid+geometric_pid",
    "indi+indi",
    "l1+se3",
)
EFFECTIVENESS = "simulator.rigid_body.effectiveness"
TORQUE = ("roll", "pitch", "yaw")
SECONDS, LARGEST, NOISIEST, HALVINGS = 20.0, 1.0, 10.0, 7
MASS = 0.56


class Margin(NamedTuple):
    """A quantity from ``good`` towards ``bad``, and the settings that it stands for."""

    title: str
    unit: str
    factor: float
    good: float
    bad: float
    settings: Callable[[float], list[str]]


MARGINS = (
    Margin("delay", "ms", 1e3, 0.0, 0.1, lambda x: [f"simulator.sensor.delay={x}", *WITHOUT]),
    Margin("delay, predicted", "ms", 1e3, 0.0, 0.1, lambda x: [f"simulator.sensor.delay={x}", *predicting(x)]),
    Margin("rotor lag", "ms", 1e3, 0.0, 0.3, lambda x: [f"vehicle.rotor_time_constant={x}"]),
    Margin("torque up to", "x", 1.0, 1.0, 2.0, lambda x: [f"{EFFECTIVENESS}.{name}={x}" for name in TORQUE]),
    Margin("torque down to", "x", 1.0, 1.0, 0.0, lambda x: [f"{EFFECTIVENESS}.{name}={x}" for name in TORQUE]),
    Margin("thrust down to", "x", 1.0, 1.0, 0.0, lambda x: [f"{EFFECTIVENESS}.thrust={x}"]),
    Margin("mass up to", "x", 1.0, 1.0, 4.0, lambda x: [f"simulator.rigid_body.mass_error={MASS * (x - 1.0)}"]),
    Margin("mass down to", "x", 1.0, 1.0, 0.05, lambda x: [f"simulator.rigid_body.mass_error={MASS * (x - 1.0)}"]),
)


def flown(pair, settings, seed=1):
    """Return the result of the flight of a pair POSITION+ATTITUDE."""
    position, _, attitude = pair.partition("+")
    common = {"position": position, "attitude": attitude, "duration": SECONDS}
    flight = from_names("case2", **common, settings=["simulator.guard.enabled=false", *settings])
    return fly(flight._replace(seed=seed), compiled=True, logging=False)


def is_good(result, nominal):
    """Return whether a flight counts as good; ``nominal`` torque variation in N m."""
    score = result.score
    return result.outcome == "ended" and score.largest_error <= LARGEST and score.torque_variation <= NOISIEST * nominal


def found(margin, is_good):
    """Return the last value towards ``margin.bad`` whose settings are good; that itself if all of the way is good."""
    good, bad = margin.good, margin.bad
    if is_good(margin.settings(bad)):
        return f"> {margin.factor * bad:.3g}" if bad > good else f"< {margin.factor * bad:.3g}"
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if is_good(margin.settings(middle)) else (good, middle)
    return f"{margin.factor * good:.3g}"


def flies(pair):
    """Return a function that tells whether the flight of ``pair`` with given settings is good."""
    nominal = flown(pair, []).score.torque_variation
    return lambda settings: is_good(flown(pair, settings), nominal)


def is_stable(pair):
    """Return a function that tells whether the linearised hover of ``pair`` with given settings is stable."""
    position, _, attitude = pair.partition("+")
    return lambda settings: largest(hover(settings, position=position, attitude=attitude)) <= STABLE


def table(pairs, judge=flies, margins=MARGINS):
    """Print one row per pair."""
    print("| pair | " + " | ".join(f"{m.title}, {m.unit}" for m in margins) + " |")
    print("|---" * (len(margins) + 1) + "|")
    for pair in pairs:
        is_good = judge(pair)
        print(f"| {pair} | " + " | ".join(found(margin, is_good) for margin in margins) + " |", flush=True)


def linear(pairs):
    """Print one row per pair; a linear loop knows no limit of thrust, and without torque it only drifts."""
    table(pairs, is_stable, MARGINS[:4])


RAISED = {
    "aibs": ("aibs.limits.acceleration_z=40.0", "aibs.observer.max_estimate=40.0"),
    "ibs": ("ibs.limits.acceleration_z=40.0",),
    "pid": ("pid.limits.acceleration_z=40.0", "pid.xy.max_integral=40.0", "pid.z.max_integral=40.0"),
    "se3": ("se3.limits.acceleration_z=40.0",),
    "geometric_pid": ("geometric_pid.limits.acceleration_z=40.0", "geometric_pid.z.max_integral=4.0"),
    "indi": ("indi.limits.acceleration_z=40.0",),
    "l1": ("l1.limits.acceleration_z=40.0", "l1.max_estimate=40.0"),
}


def _with(settings: Callable[[float], list[str]], extra: list[str], x: float) -> list[str]:
    return [*settings(x), *extra]


def why(pairs):
    """Print RMSE and share of thrust down to which each pair flies, with the limits as shipped and raised."""
    names = ("shipped", "acceleration raised", "and the estimate")
    print("| pair | " + " | ".join(f"thrust down to, {name}" for name in names) + " |\n|---|---|---|---|")
    thrust = next(margin for margin in MARGINS if margin.title == "thrust down to")
    for pair in pairs:
        is_good = flies(pair)
        raised = [f"position_controller.{setting}" for setting in RAISED[pair.partition("+")[0]]]
        cells = []
        for extra in ([], raised[:1], raised):
            margin = thrust._replace(settings=partial(_with, thrust.settings, extra))
            cells.append(found(margin, is_good))
        print(f"| {pair} | {' | '.join(cells)} |", flush=True)


def cross(pairs):
    """Print medians of RMSE and torque variation of each pair, all with feed-forward, as the laws come."""
    rough = ["simulator.sensor.delay=0.01", *predicting(0.01), *NOISE, *LAG]
    rough += ["position_controller.prediction.smoothing=10.0", "attitude_controller.prediction.rate_smoothing=60.0"]
    print(
        "| pair | ideal: RMSE | torque variation | delay, noise, lag: RMSE | torque variation | lost |\n"
        + "|---" * 6
        + "|"
    )
    for pair in pairs:
        cells, lost = [], 0
        for settings in ([], rough):
            results = [flown(pair, settings, seed) for seed in range(1001, 1011)]
            good = [one for one in results if one.outcome == "ended" and one.score.largest_error <= LARGEST]
            lost += len(results) - len(good)
            rmse = 1e3 * np.array([one.rmse for one in good])
            torque = np.median([one.score.torque_variation for one in good])
            cells += [f"{np.median(rmse):.1f} mm ({rmse.min():.1f} to {rmse.max():.1f})", f"{torque:.1f} N m"]
        print(f"| {pair} | {' | '.join(cells)} | {lost} of 20 |", flush=True)


def main():
    """Print the table that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="+", choices=("table", "linear", "why", "cross"))
    parser.add_argument("--pair", action="append", choices=PAIRS, help="may be repeated (default: all)")
    options = parser.parse_args()
    for what in options.what:
        {"table": table, "linear": linear, "why": why, "cross": cross}[what](options.pair or PAIRS)
        print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
