"""Two campaigns that drew the same values, flight by flight: which is better, with exact bounds.

Flight n of a campaign draws its values from (seed, n, parameter), so two files with the same ``seed`` and ``vary`` and
other laws fly the same vehicles through the same disturbances. Successes: exact test of McNemar (1947) on flights that
one alone brought to success. Errors: median over pairs of the ratio of RMSE, with bounds by order statistics.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from quad_campaign.parts import FLIGHTS
from quad_core.parameters import ParameterError

CONFIDENCE = 0.95


class Pairs(NamedTuple):
    """Counts of successes with exact p; the median ratio of RMSE, ours over theirs, with bounds, of ``ended`` pairs."""

    both: int
    ours_alone: int
    theirs_alone: int
    neither: int
    p: float
    ratio: float
    low: float
    high: float
    ended: int


def flights_of(directory: Path) -> pd.DataFrame:
    """Return the flights of a campaign's directory; raises ParameterError if it holds none."""
    path = directory / FLIGHTS
    if not path.is_file():
        raise ParameterError(f"--against: found no {path}, expected the directory of a campaign that was flown")
    return pd.read_parquet(path)


def paired(ours: pd.DataFrame, theirs: pd.DataFrame, drawn: list[str]) -> Pairs:
    """Compare flights with the same number; raises ParameterError if a value in ``drawn`` differs."""
    from scipy.stats import binomtest

    count = min(len(ours), len(theirs))
    ours, theirs = ours.head(count), theirs.head(count)
    for name in drawn:
        if name not in theirs:
            raise ParameterError(f"--against: found no {name}, expected a campaign with the same `vary`")
        apart = np.flatnonzero(ours[name].to_numpy() != theirs[name].to_numpy())
        if len(apart):
            n = int(apart[0])
            found = f"found {name} {theirs[name].iloc[n]} in flight {n}, expected {ours[name].iloc[n]}"
            raise ParameterError(f"--against: {found}: the same `seed` and `vary` draw the same values")
    good, other = ours["success"].to_numpy(dtype=bool), theirs["success"].to_numpy(dtype=bool)
    alone, theirs_alone = int((good & ~other).sum()), int((other & ~good).sum())
    p = float(binomtest(alone, alone + theirs_alone).pvalue) if alone + theirs_alone else 1.0
    ended = ((ours["outcome"] == "ended").to_numpy()) & ((theirs["outcome"] == "ended").to_numpy())
    ratios = np.sort(ours["rmse"].to_numpy()[ended] / theirs["rmse"].to_numpy()[ended])
    counts = (int((good & other).sum()), alone, theirs_alone, int((~good & ~other).sum()))
    return Pairs(*counts, p, *_median(ratios), len(ratios))


def _median(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> tuple[float, float, float]:
    """Return the median of sorted values and its exact bounds, infinite where there are too few."""
    from scipy.stats import binom

    count = len(values)
    if not count:
        return float("nan"), 0.0, float("inf")
    place = int(binom.ppf((1.0 - CONFIDENCE) / 2.0, count, 0.5))  # below this many of them: less than 2.5 % likely
    if place < 1:
        return float(np.median(values)), 0.0, float("inf")
    return float(np.median(values)), float(values[place - 1]), float(values[count - place])
