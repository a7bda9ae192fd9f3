"""The robustness map: how much delay, loss of effectiveness and mass error each pair of laws tolerates, as a picture.

Every square is the largest RMSE of Case 2 over the seeds, first 20 s of the curve, with the measurement late by the
delay below and the plant off by what stands on the left; grey: a flight left its bounds.

Examples:
  python studies/robustness.py --out robustness.png
  python studies/robustness.py --pairs aibs+abfnitsm pid+pid --seeds 1 2 3 --out robustness.png
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_campaign.batch import ENDED
from quad_campaign.definition import Definition, base_flight
from quad_core import plugins
from quad_core.parameters import ParameterError, Value
from quad_core.plugins import PluginError
from quad_flight.flight import Flight, fly
from quad_flight.many import all_of
from quad_flight.variation import SEED, Variation

DELAY = "simulator.sensor.delay"
MASS = "simulator.rigid_body.mass_error"
GAINS = tuple(f"simulator.rigid_body.effectiveness.{name}" for name in ("thrust", "roll", "pitch", "yaw"))
DELAYS = tuple(0.005 * n for n in range(13))
SHARES = tuple(0.1 * n for n in range(-5, 6))
PAIRS = ("aibs+abfnitsm", "ibs+itsm", "pid+pid", "se3+se3")
_DURATION = 20.0


class Map(NamedTuple):
    """Largest RMSE in m of each (error, delay), shape (errors, delays); NaN where a flight was lost."""

    pair: str
    what: str
    rmse: NDArray[np.float64]


def maps(pair: str, seeds: Sequence[int], *, compiled: bool = True) -> list[Map]:
    """Return the maps of one pair of laws, POSITION+ATTITUDE: gain error over delay and mass error over delay."""
    position, _, attitude = pair.partition("+")
    flight = {"case": "case2", "position": position, "attitude": attitude, "duration": _DURATION}
    base = base_flight(Definition("map", "", flight, {}, {}, 1))
    variation = Variation(base, (DELAY, MASS, *GAINS, SEED))

    def grid(what: str, changes: Callable[[float], dict[str, Value]]) -> Map:
        def worst(square: tuple[float, float]) -> float:
            share, delay = square
            changed = {DELAY: delay, **changes(share)}
            return max(
                (_rmse(variation.apply({**changed, SEED: seed}), compiled) for seed in seeds),
                key=lambda error: (np.isnan(error), error),
            )

        squares = list(product(SHARES, DELAYS))
        return Map(pair, what, np.reshape(all_of(worst, squares), (len(SHARES), len(DELAYS))))

    mass = base.setup.vehicle.mass
    return [
        grid("effectiveness error", lambda share: dict.fromkeys(GAINS, 1.0 + share)),
        grid("mass error", lambda share: {MASS: share * mass}),
    ]


def draw(found: Sequence[Map], path: Path) -> None:
    """Write the picture of all maps: a column per pair, a row per kind of error."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.colors import LogNorm

    pairs = list(dict.fromkeys(one.pair for one in found))
    kinds = list(dict.fromkeys(one.what for one in found))
    figure, axes = plt.subplots(
        len(kinds), len(pairs), figsize=(3.4 * len(pairs) + 1.0, 3.0 * len(kinds)), squeeze=False, layout="constrained"
    )
    colours = mpl.colormaps["viridis_r"].copy()
    colours.set_bad("0.75")
    edges = (1e3 * (DELAYS[0] - 0.0025), 1e3 * (DELAYS[-1] + 0.0025), 100 * SHARES[0] - 5, 100 * SHARES[-1] + 5)
    for one in found:
        axis = axes[kinds.index(one.what)][pairs.index(one.pair)]
        norm = LogNorm(0.01, 3.0)
        image = axis.imshow(one.rmse, origin="lower", aspect="auto", extent=edges, cmap=colours, norm=norm)
        axis.set(title=one.pair, xlabel="delay, ms", ylabel=f"{one.what}, %")
    figure.colorbar(image, ax=axes, label="largest RMSE, m (grey: lost)")
    figure.savefig(path, dpi=80)
    plt.close(figure)


def borne(one: Map, limit: float) -> tuple[float, int]:
    """Return the longest tolerated delay (s) and the number of tolerated squares at an RMSE of at most ``limit`` m."""
    good = one.rmse <= limit
    middle = good[len(SHARES) // 2]
    first_bad = len(DELAYS) if middle.all() else int(np.argmin(middle))
    return (DELAYS[first_bad - 1] if first_bad else float("nan")), int(good.sum())


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly the maps and draw them; returns the exit code."""
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="robustness", description=__doc__, formatter_class=formatter)
    parser.add_argument("--pairs", nargs="+", metavar="POSITION+ATTITUDE", help=f"default: of {', '.join(PAIRS)}")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2], metavar="N")
    parser.add_argument("--limit", type=float, default=0.25, metavar="M", help="largest RMSE that counts as tolerated")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE")
    options = parser.parse_args(arguments)
    found = []
    try:
        for pair in options.pairs or installed():
            sys.stderr.write(f"robustness: {pair} ...\n")
            found += maps(pair, options.seeds)
    except (ParameterError, PluginError) as error:
        sys.stderr.write(f"robustness: {error}\n")
        return 2
    draw(found, options.out)
    for one in found:
        delay, squares = borne(one, options.limit)
        sys.stdout.write(
            f"{one.pair:16s} {one.what:20s} delay alone {1e3 * delay:.0f} ms, {squares} of {one.rmse.size} squares "
            f"within {options.limit:g} m\n"
        )
    return 0


def installed() -> list[str]:
    """Return the pairs of PAIRS whose laws are installed."""
    position, attitude = plugins.names(plugins.POSITION_LAW), plugins.names(plugins.ATTITUDE_LAW)
    return [pair for pair in PAIRS if pair.split("+")[0] in position and pair.split("+")[1] in attitude]


def _rmse(flight: Flight, compiled: bool) -> float:
    result = fly(flight, compiled=compiled, logging=False)
    return result.rmse if result.outcome == ENDED else float("nan")


if __name__ == "__main__":
    sys.exit(main())
