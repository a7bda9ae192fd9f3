"""Which parameters of a campaign decide how its flights end: the share of the order of flights that each explains.

Flights are ranked by RMSE, those that did not end behind all others. For one parameter they are put into ten groups
of equal size by its value (a choice: a group for each). Share: epsilon squared = 1 - (n - 1) / (n - k) * W / T, with n
flights, k groups, W the sum of squares of the ranks within groups and T that of all: 0 for what has no influence, on
average; 1 for what decides alone. The test is that of Kruskal and Wallis (1952), its p multiplied by the parameters.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd

from quad_flight.variation import SEED

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
