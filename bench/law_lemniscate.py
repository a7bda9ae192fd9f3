"""Lemniscates of 5, 8, 10 and 12 m/s, 10 m from the crossing to a tip, plant rigid_body, the paper's disturbance.

One row per pair of laws and source of the desired rates: `filter` is the command filter alone, `led` leads its input
by the rates and accelerations that the reference asks for, `feed_forward` takes those without a filter. Beyond 10 m/s
the limits of the position law and the thrust are opened: such a curve asks for more.
``--pair nmpc`` (not among the default ones) is an outside nonlinear MPC in the place of both laws, without knowledge of
the disturbance and with the estimate of our observer, and what a solution took it.

Examples:
  python bench/law_lemniscate.py
  python bench/law_lemniscate.py --steep --seeds 1
  python bench/law_lemniscate.py --pair nmpc
  python bench/law_lemniscate.py --pair se3+se3 --source led --speed 20 --half-width 20 --vehicle x500
  python bench/law_lemniscate.py --pair aibs+abfnitsm --pair aibs+indi --speed 5 --seeds 20
"""

import argparse
import sys

import numpy as np
from law_margins import PAIRS

from quad_flight.flight import fly, from_names

HALF_WIDTH, SECONDS, LOST = 10.0, 20.0, 1.0
NMPC = "nmpc"
SOURCES = ("filter", "led", "feed_forward")
NESTED = ("geometric_pid", "indi", "itsm", "pid", "se3")
"""Attitude laws whose source of the desired rates stands in the group `shaping`."""
STEEP = ((10.0, 5.0), (12.0, 4.0))
"""m/s, and m from the crossing to a tip: 65 and 76 deg of tilt."""
FASTEST = 10.0
"""m/s that the limits admit."""
OPEN = ("acceleration_xy=80.0", "acceleration_z=40.0", "tilt=1.5")


def outside(options, observed, speed):
    """Return the results of flights under the outside MPC, and how many ms its solutions took."""
    from peer_nmpc import Problem, under_nmpc

    flight = prepared(options, "aibs", "abfnitsm", speed, [])
    problem = Problem(flight.setup.vehicle)
    flights = [flight._replace(seed=seed) for seed in range(1001, 1001 + options.seeds)]
    results = [fly(under_nmpc(one, problem, observed), logging=False) for one in flights]
    took = 1e3 * np.array(problem.seconds)
    times = f"{np.median(took):.1f} ms a solution, 99 % within {np.percentile(took, 99):.1f}"
    return results, f"{times}, {problem.failures} of {len(took)} not solved"


def prepared(options, position, attitude, speed, settings):
    """Return the flight of a pair with the settings of this bench and ``settings``."""
    settings = [
        "simulator.guard.enabled=false",
        f"trajectory.lemniscate.speed={speed}",
        f"trajectory.lemniscate.half_width={options.half_width}",
        *settings,
        *options.set,
    ]
    common = {
        "vehicle": options.vehicle,
        "preset": options.preset,
        "position": position,
        "attitude": attitude,
        "duration": SECONDS,
    }
    return from_names("lemniscate", **common, settings=settings)


def flown(options, pair, source, speed, more=()):
    """Return the results of the flights of a pair, from seed 1001 on."""
    position, _, attitude = pair.partition("+")
    group = f"{attitude}.shaping" if attitude in NESTED else attitude
    ahead = str(source != "filter").lower()
    settings = [
        f"position_controller.{position}.feed_forward={ahead}",
        f"attitude_controller.{group}.command={source}",
        *more,
    ]
    flight = prepared(options, position, attitude, speed, settings)
    return [fly(flight._replace(seed=seed), compiled=True, logging=False) for seed in range(1001, 1001 + options.seeds)]


def opened(pair):
    """Return the settings that open the limits of a pair's position law and the vehicle's thrust."""
    position = pair.partition("+")[0]
    return ["vehicle.thrust_to_weight=8.0", *(f"position_controller.{position}.limits.{limit}" for limit in OPEN)]


def steep(options, pair):
    """Print the row of a pair on the steep lemniscates, limits opened."""
    cells = []
    for speed, half in STEEP:
        more = [*opened(pair), f"trajectory.lemniscate.half_width={half}"]
        cells.append(cell(flown(options, pair, "led", speed, more)))
    print(f"| {pair} | led | {' | '.join(cells)} |", flush=True)


def cell(results):
    """Return the median RMSE with its range, and how many flights were lost."""
    good = [one for one in results if one.outcome == "ended" and one.score.largest_error <= LOST]
    lost = f", {len(results) - len(good)} lost" if len(good) < len(results) else ""
    if not good:
        return "lost"
    rmse = 1e3 * np.array([one.rmse for one in good])
    torque = np.median([one.score.torque_variation for one in good])
    return f"{np.median(rmse):.1f} mm ({rmse.min():.1f} to {rmse.max():.1f}), {torque:.1f} N m{lost}"


def main():
    """Print the table that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--pair", action="append", choices=(*PAIRS, NMPC), help="may be repeated (default: all but nmpc)"
    )
    parser.add_argument("--speed", action="append", type=float, help="m/s; may be repeated (default: 5, 8, 10, 12)")
    parser.add_argument("--source", action="append", choices=SOURCES, help="may be repeated (default: all)")
    parser.add_argument("--vehicle", default="paper", help="vehicle file (default: paper)")
    parser.add_argument("--preset", default="tuned", help="preset, or a file with gains (default: tuned)")
    parser.add_argument("--seeds", type=int, default=5, metavar="N", help="held-out seeds from 1001 (default: 5)")
    parser.add_argument("--set", action="append", default=[], metavar="NODE.NAME=VALUE", help="may be repeated")
    parser.add_argument(
        "--half-width", type=float, default=HALF_WIDTH, metavar="M", help="crossing to tip (default: 10)"
    )
    parser.add_argument("--steep", action="store_true", help="65 and 76 deg of tilt instead, limits opened")
    options = parser.parse_args()
    if options.steep:
        print("| pair | desired rates | 10 m/s, 5 m | 12 m/s, 4 m |\n|---|---|---|---|")
        for pair in options.pair or PAIRS:
            steep(options, pair)
        return 0
    speeds = options.speed or [5.0, 8.0, 10.0, 12.0]
    print("| pair | desired rates | " + " | ".join(f"{speed:g} m/s" for speed in speeds) + " |")
    print("|---" * (2 + len(speeds)) + "|")
    pairs = options.pair or PAIRS
    for observed in (False, True) if NMPC in pairs else ():
        found = [outside(options, observed, speed) for speed in speeds]
        cells = [f"{cell(results)}; {times}" for results, times in found]
        print(f"| nmpc{', with the estimate' if observed else ''} | | {' | '.join(cells)} |", flush=True)
    for pair in [pair for pair in pairs if pair != NMPC]:
        for source in options.source or SOURCES:
            cells = [cell(flown(options, pair, source, v, opened(pair) if v > FASTEST else ())) for v in speeds]
            print(f"| {pair} | {source} | {' | '.join(cells)} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
