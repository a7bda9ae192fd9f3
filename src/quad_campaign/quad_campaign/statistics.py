"""Which of two campaigns that drew the same values is better, with exact bounds, and which parameters decide.

Flight n of a campaign draws its values from (seed, n, parameter), so two files with the same ``seed`` and ``vary`` and
other laws fly the same vehicles through the same disturbances. Successes: exact test of McNemar (1947) on flights that
one alone brought to success. Errors: median over pairs of the ratio of RMSE, with bounds by order statistics.

For the share of a parameter flights are ranked by RMSE, those that did not end behind all others, and put into ten
groups of equal size by its value (a choice: a group for each). Share: epsilon squared = 1 - (n - 1) / (n - k) * W / T,
with n flights, k groups, W the sum of squares of the ranks within groups and T that of all: 0 for what has no
influence, on average; 1 for what decides alone. The test is that of Kruskal and Wallis (1952), its p multiplied by the
parameters.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from quad_campaign.batch import FLIGHTS
from quad_core.parameters import ParameterError, Value
from quad_flight.variation import SEED

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


def refuse_other_draws(ours: Sequence[Mapping[str, Value]], theirs: pd.DataFrame) -> None:
    """Raise ParameterError if flights of ``theirs`` had other values than ``ours``, {name: value} of each flight."""
    for n, values in enumerate(ours[: len(theirs)]):
        for name, value in values.items():
            if name not in theirs:
                raise ParameterError(f"--against: found no {name}, expected a campaign with the same `vary`")
            if theirs[name].iloc[n] != value:
                found = f"found {name} {theirs[name].iloc[n]} in flight {n}, expected {value}"
                raise ParameterError(f"--against: {found}: the same `seed` and `vary` draw the same values")


def paired(ours: pd.DataFrame, theirs: pd.DataFrame) -> Pairs:
    """Compare flights with the same number, which had the same values (``refuse_other_draws``)."""
    from scipy.stats import binomtest

    count = min(len(ours), len(theirs))
    ours, theirs = ours.head(count), theirs.head(count)
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


GROUPS = 10


class Influence(NamedTuple):
    """``share`` of the order of flights, 0 to 1; ``p``: how likely chance alone gives it; ``best``: the best group."""

    parameter: str
    share: float
    p: float
    best: str


def badness(frame: pd.DataFrame) -> pd.Series:
    """Return the rank of each flight, 1 for the smallest RMSE; lost flights last, the sooner the later."""
    ended = frame["outcome"] == "ended"
    keys = pd.DataFrame({"lost": ~ended, "size": frame["rmse"].where(ended, -frame["steps"].astype(float))})
    return keys.apply(tuple, axis=1).rank(method="average")


def influences(frame: pd.DataFrame, parameters: Iterable[str]) -> list[Influence]:
    """Return the parameters that vary by their share, the largest first."""
    from scipy.stats import kruskal

    ranks, found = badness(frame), []
    varied = [name for name in parameters if name != SEED and frame[name].nunique() > 1]
    total, flights = float(((ranks - ranks.mean()) ** 2).sum()), len(ranks)
    for name in varied:
        groups = _groups(frame[name])
        own = [ranks[places].to_numpy() for places in groups.values()]
        within = sum(float(((group - group.mean()) ** 2).sum()) for group in own)
        if total == 0.0 or flights <= len(own):
            continue
        share = 1.0 - (flights - 1) / (flights - len(own)) * within / total
        p = min(1.0, len(varied) * float(kruskal(*own).pvalue))
        best = list(groups)[int(np.argmin([group.mean() for group in own]))]
        found.append(Influence(name, max(0.0, share), p, best))
    return sorted(found, key=lambda each: -each.share)


def _groups(values: pd.Series) -> dict[str, pd.Index]:
    """Return {what the group is: its flights} of one parameter."""
    numeric = pd.api.types.is_numeric_dtype(values) and not pd.api.types.is_bool_dtype(values)
    if not numeric or values.nunique() <= GROUPS:
        return {str(value): own.index for value, own in values.groupby(values)}
    parts = np.array_split(values.sort_values(kind="stable").index, GROUPS)
    return {f"{values[own].min():.4g} to {values[own].max():.4g}": pd.Index(own) for own in parts}
