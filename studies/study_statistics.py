"""Medians, ranges and paired differences of the flights of a study."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def summary(flights: Any, controllers: Sequence[str], metrics: Sequence[str], resamples: int, seed: int) -> Any:
    """Return the table ``summary.parquet`` of ``study`` (pandas) from the table of flights.

    ``resamples`` bootstrap samples per interval, drawn with ``seed`` anew for each, so that no row depends on another.
    """
    import pandas

    rows = []
    for (case, plant), group in flights.groupby(["case", "plant"], sort=False):
        by_controller = {name: group[group["controller"] == name].set_index("seed") for name in controllers}
        first = by_controller[controllers[0]]
        for name in controllers:
            own = by_controller[name]
            for metric in metrics:
                row = {"controller": name, "case": case, "plant": plant, "metric": metric}
                row |= {"flights": len(own), "ended": int((own["outcome"] == "ended").sum())}
                row |= spread(own[metric].to_numpy(float))
                other = np.full(0, np.nan)
                if name != controllers[0]:
                    both = own.index.intersection(first.index)
                    other = own.loc[both, metric].to_numpy(float) - first.loc[both, metric].to_numpy(float)
                rows.append(row | paired(other, resamples, seed))
    return pandas.DataFrame(rows)


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
