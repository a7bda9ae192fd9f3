"""Medians, ranges and paired differences of the flights of a study, and what the luck of the tuner leaves of them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

PLACE = ["case", "plant", "condition"]
ALL = "all conditions"
Floats = NDArray[np.float64]


def summary(flights: Any, controllers: Sequence[str], metrics: Sequence[str], resamples: int, seed: int) -> Any:
    """Return the table ``summary.parquet`` of ``study`` (pandas) from the table of flights.

    ``resamples`` bootstrap samples per interval, drawn with ``seed`` anew for each, so that no row depends on another.
    Pairs are of one held-out seed, each controller with the mean over its tunings.
    """
    import pandas

    rows = []
    for place, group in flights.groupby(PLACE, sort=False):
        by_controller = {name: group[group["controller"] == name] for name in controllers}
        by_seed = {name: own.groupby("seed")[list(metrics)].mean() for name, own in by_controller.items()}
        for name, own in by_controller.items():
            ended = {"flights": len(own), "ended": int((own["outcome"] == "ended").sum())}
            for metric in metrics:
                apart = (by_seed[name][metric] - by_seed[controllers[0]][metric]).to_numpy(float)
                row = {"controller": name, **dict(zip(PLACE, place, strict=True)), "metric": metric, **ended}
                row |= spread(own[metric].to_numpy(float))
                rows.append(row | paired(apart if name != controllers[0] else apart[:0], resamples, seed))
    return pandas.DataFrame(rows)


def comparison(flights: Any, controllers: Sequence[str]) -> Any:
    """Return the table ``comparison.parquet`` of ``study``: costs over tunings, by condition and over all.

    ``ratio`` is the geometric mean of the costs of a controller's tunings over that of the first one's, ``p`` that of
    Welch's t test on the logarithms, ``p_holm`` that after Holm's procedure over all rows; NaN below two tunings.
    """
    import pandas

    rows = []
    flown = [*dict.fromkeys(flights["condition"])]
    for condition in [*flown, ALL] if len(flown) > 1 else flown:
        chosen = flights if condition == ALL else flights[flights["condition"] == condition]
        costs = chosen.groupby(["controller", "tuning"])["cost"].mean()
        lost = chosen[chosen["outcome"] != "ended"].groupby("controller").size()
        for name in controllers:
            own = costs[name].to_numpy(float)
            row = {"controller": name, "condition": condition, "tunings": len(own), "lost": int(lost.get(name, 0))}
            names = ("ratio", "ratio_low", "ratio_high", "p")
            found = ratio(own, costs[controllers[0]].to_numpy(float)) if name != controllers[0] else (np.nan,) * 4
            row |= dict(zip(("cost", "cost_low", "cost_high"), mean_interval(own), strict=True))
            rows.append(row | dict(zip(names, found, strict=True)))
    table = pandas.DataFrame(rows)
    table["p_holm"] = holm(table["p"].to_numpy(float))
    return table


def mean_interval(values: Floats) -> tuple[float, float, float]:
    """Return the mean and its 95 % interval by Student's t; NaN for that of one or two values, which says nothing."""
    from scipy.stats import t

    mean = float(np.mean(values))
    if len(values) < 3:
        return mean, float("nan"), float("nan")
    half = float(t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / np.sqrt(len(values)))
    return mean, mean - half, mean + half


def ratio(ours: Floats, theirs: Floats) -> tuple[float, float, float, float]:
    """Return the ratio of the geometric means, its 95 % interval, and p of no difference (Welch's t on logarithms).

    Degrees of freedom are Welch and Satterthwaite's. NaN with fewer than two values, or values that are all equal.
    """
    from scipy.stats import t

    logs = [np.log(values) for values in (ours, theirs)]
    middle = float(np.mean(logs[0]) - np.mean(logs[1]))
    degrees = np.array([len(values) - 1 for values in logs])
    shares = np.array([np.var(values, ddof=1) / len(values) if len(values) > 1 else 0.0 for values in logs])
    if degrees.min() < 1 or shares.sum() == 0.0:
        return float(np.exp(middle)), float("nan"), float("nan"), float("nan")
    spread, freedom = float(np.sqrt(shares.sum())), float(shares.sum() ** 2 / np.sum(shares**2 / degrees))
    half = float(t.ppf(0.975, freedom)) * spread
    p = 2.0 * float(t.sf(abs(middle) / spread, freedom))
    return float(np.exp(middle)), float(np.exp(middle - half)), float(np.exp(middle + half)), p


def holm(p: Floats) -> Floats:
    """Return the p values after Holm's step-down procedure over those that are numbers (S. Holm, 1979)."""
    adjusted = np.full(len(p), np.nan)
    order = np.argsort(p)[: int(np.isfinite(p).sum())]
    stepped = p[order] * np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(stepped))
    return adjusted


def front(error: Floats, effort: Floats) -> NDArray[np.int64]:
    """Return the places of the pairs that no other beats in both, by rising error; pairs without a number never are."""
    good = np.flatnonzero(np.isfinite(error) & np.isfinite(effort))
    order = good[np.lexsort((effort[good], error[good]))]
    best = np.minimum.accumulate(effort[order])
    return order[np.concatenate(([True], best[1:] < best[:-1]))[: len(order)]]


def spread(values: NDArray[np.float64]) -> dict[str, float]:
    """Return median, 5 % and 95 % quantile of the numbers among ``values``; NaN without any."""
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return dict.fromkeys(("median", "low", "high"), float("nan"))
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return {"median": float(middle), "low": float(low), "high": float(high)}


def paired(differences: NDArray[np.float64], resamples: int, seed: int) -> dict[str, float]:
    """Return the median of paired differences and its 95 % bootstrap confidence interval (percentile method)."""
    from scipy.stats import bootstrap

    differences = differences[np.isfinite(differences)]
    keys = ("difference", "difference_low", "difference_high")
    if len(differences) == 0:
        return {"pairs": 0, **dict.fromkeys(keys, float("nan"))}
    middle = float(np.median(differences))
    low = high = middle
    if len(differences) > 1 and np.ptp(differences) > 0.0:
        found = bootstrap(
            (differences,), np.median, n_resamples=resamples, method="percentile", rng=np.random.default_rng(seed)
        ).confidence_interval
        low, high = float(found.low), float(found.high)
    return {"pairs": len(differences), **dict(zip(keys, (middle, low, high), strict=True))}
