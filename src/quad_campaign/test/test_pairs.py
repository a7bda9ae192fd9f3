"""Two campaigns side by side: counts, exact bounds, and the refusal of other draws."""

import numpy as np
import pandas as pd
import pytest

from quad_campaign.pairs import flights_of, paired
from quad_core.parameters import ParameterError

pytestmark = pytest.mark.unit


def flights(rmse, success=None, mass=None, outcome="ended"):
    count = len(rmse)
    columns = {
        "outcome": outcome,
        "rmse": rmse,
        "success": [True] * count if success is None else success,
        "mass": range(count) if mass is None else mass,
    }
    return pd.DataFrame(columns)


def test_the_median_of_ratios_has_exact_bounds():
    theirs = flights(np.ones(20))
    found = paired(flights(np.arange(1, 21) / 10.0), theirs, ["mass"])
    assert (found.ratio, found.low, found.high, found.ended) == pytest.approx((1.05, 0.6, 1.5, 20))  # 6th, 15th of 20
    few = paired(flights(np.ones(5)), flights(np.ones(5)), ["mass"])
    assert (few.low, few.high) == (0.0, float("inf"))


def test_the_bounds_hold_the_median_as_often_as_they_say():
    draw, held = np.random.default_rng(5), 0
    for _ in range(400):
        found = paired(flights(draw.lognormal(0.3, 1.0, 41)), flights(np.ones(41)), ["mass"])
        held += found.low <= np.exp(0.3) <= found.high
    assert 0.93 < held / 400 <= 1.0


def test_successes_are_counted_in_pairs_with_mcnemar_s_exact_p():
    ours = flights(np.ones(12), [True] * 10 + [False] * 2)
    theirs = flights(np.ones(12), [True] * 2 + [False] * 9 + [True])
    found = paired(ours, theirs, ["mass"])
    assert (found.both, found.ours_alone, found.theirs_alone, found.neither) == (2, 8, 1, 1)
    assert found.p == pytest.approx(2 * (9 + 1) / 2**9)  # 8 or 9 of 9, both tails
    assert paired(ours, ours, []).p == 1.0


def test_flights_that_did_not_end_are_no_ratio():
    ours = flights([1.0, 2.0, 3.0], outcome=["ended", "tilt", "ended"])
    assert paired(ours, flights([1.0, 1.0, 1.0]), []).ended == 2


def test_other_draws_are_refused_by_flight_and_parameter(tmp_path):
    ours = flights([1.0, 1.0], mass=[0.5, 0.6])
    with pytest.raises(ParameterError, match=r"found mass 0.7 in flight 1, expected 0.6"):
        paired(ours, flights([1.0, 1.0], mass=[0.5, 0.7]), ["mass"])
    with pytest.raises(ParameterError, match="found no wind"):
        paired(ours.assign(wind=0.0), ours, ["wind"])
    with pytest.raises(ParameterError, match=r"found no .*flights.parquet"):
        flights_of(tmp_path)
