"""Two campaigns side by side: counts, exact bounds; parameters ranked as is known of how the flights were made."""

import numpy as np
import pandas as pd
import pytest

from quad_campaign.statistics import badness, flights_of, influences, paired, refuse_other_draws
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
    found = paired(flights(np.arange(1, 21) / 10.0), theirs)
    assert (found.ratio, found.low, found.high, found.ended) == pytest.approx((1.05, 0.6, 1.5, 20))  # 6th, 15th of 20
    few = paired(flights(np.ones(5)), flights(np.ones(5)))
    assert (few.low, few.high) == (0.0, float("inf"))


def test_the_bounds_hold_the_median_as_often_as_they_say():
    draw, held = np.random.default_rng(5), 0
    for _ in range(400):
        found = paired(flights(draw.lognormal(0.3, 1.0, 41)), flights(np.ones(41)))
        held += found.low <= np.exp(0.3) <= found.high
    assert 0.93 < held / 400 <= 1.0


def test_successes_are_counted_in_pairs_with_mcnemar_s_exact_p():
    ours = flights(np.ones(12), [True] * 10 + [False] * 2)
    theirs = flights(np.ones(12), [True] * 2 + [False] * 9 + [True])
    found = paired(ours, theirs)
    assert (found.both, found.ours_alone, found.theirs_alone, found.neither) == (2, 8, 1, 1)
    assert found.p == pytest.approx(2 * (9 + 1) / 2**9)  # 8 or 9 of 9, both tails
    assert paired(ours, ours).p == 1.0


def test_flights_that_did_not_end_are_no_ratio():
    ours = flights([1.0, 2.0, 3.0], outcome=["ended", "tilt", "ended"])
    assert paired(ours, flights([1.0, 1.0, 1.0])).ended == 2


def test_other_draws_are_refused_by_flight_and_parameter(tmp_path):
    theirs, ours = flights([1.0, 1.0], mass=[0.5, 0.7]), [{"mass": 0.5}, {"mass": 0.6}, {"mass": 0.1}]
    with pytest.raises(ParameterError, match=r"found mass 0.7 in flight 1, expected 0.6"):
        refuse_other_draws(ours, theirs)
    with pytest.raises(ParameterError, match="found no wind"):
        refuse_other_draws([{"wind": 0.0}], theirs)
    refuse_other_draws([{"mass": 0.5}, {"mass": 0.7}, {"mass": 0.1}], theirs)  # of more flights than theirs
    with pytest.raises(ParameterError, match=r"found no .*flights.parquet"):
        flights_of(tmp_path)


def ranked_flights(count=2000, seed=3):
    draw = np.random.default_rng(seed)
    mass, wind, nothing = draw.uniform(-1.0, 1.0, (3, count))
    law = draw.choice(["first", "second"], count)
    rmse = 1.0 + 2.0 * mass**2 + 0.5 * wind + 0.8 * (law == "second") + 0.1 * draw.normal(size=count)
    return pd.DataFrame(
        {"outcome": "ended", "steps": 100, "rmse": rmse, "mass": mass, "wind": wind, "nothing": nothing, "law": law}
    )


def test_parameters_are_ranked_by_what_they_explain():
    frame = ranked_flights()
    found = influences(frame, ["nothing", "wind", "law", "mass", "flight.seed"])
    assert [each.parameter for each in found] == ["mass", "law", "wind", "nothing"]
    by_name = {each.parameter: each for each in found}
    assert by_name["mass"].share > 0.5  # not monotone: a rank correlation finds 0
    assert abs(frame["mass"].corr(frame["rmse"], method="spearman")) < 0.1
    assert by_name["nothing"].share < 0.01
    assert by_name["nothing"].p > 0.05 > by_name["wind"].p
    assert by_name["law"].best == "first"
    low, high = map(float, by_name["wind"].best.split(" to "))
    assert (low, high) == pytest.approx((-1.0, -0.8), abs=0.05)


def test_the_share_of_what_has_no_influence_is_0_on_average():
    shares = [influences(ranked_flights(60, seed), ["nothing", "wind"]) for seed in range(40)]
    nothing = [each.share for found in shares for each in found if each.parameter == "nothing"]
    assert np.mean(nothing) < 0.06  # cut at 0; without the correction it would be 9 / 59 = 0.15


def test_lost_flights_are_worse_than_all_and_the_sooner_the_worse():
    frame = pd.DataFrame(
        {"outcome": ["ended", "tilt", "ended", "tilt"], "rmse": [0.2, 0.01, 0.1, 0.5], "steps": [9, 5, 9, 7]}
    )
    assert list(badness(frame)) == [2.0, 4.0, 1.0, 3.0]


def test_what_does_not_vary_or_nothing_flown_has_no_rank():
    frame = ranked_flights(5).assign(mass=1.0)
    assert influences(frame, ["mass", "flight.seed"]) == []
