"""The ranking of parameters holds against what is known of how the flights were made."""

import numpy as np
import pandas as pd
import pytest

from quad_campaign.influence import badness, influences

pytestmark = pytest.mark.unit


def flights(count=2000, seed=3):
    draw = np.random.default_rng(seed)
    mass, wind, nothing = draw.uniform(-1.0, 1.0, (3, count))
    law = draw.choice(["first", "second"], count)
    rmse = 1.0 + 2.0 * mass**2 + 0.5 * wind + 0.8 * (law == "second") + 0.1 * draw.normal(size=count)
    return pd.DataFrame(
        {"outcome": "ended", "steps": 100, "rmse": rmse, "mass": mass, "wind": wind, "nothing": nothing, "law": law}
    )


def test_parameters_are_ranked_by_what_they_explain():
    frame = flights()
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
    shares = [influences(flights(60, seed), ["nothing", "wind"]) for seed in range(40)]
    nothing = [each.share for found in shares for each in found if each.parameter == "nothing"]
    assert np.mean(nothing) < 0.06  # cut at 0; without the correction it would be 9 / 59 = 0.15


def test_lost_flights_are_worse_than_all_and_the_sooner_the_worse():
    frame = pd.DataFrame(
        {"outcome": ["ended", "tilt", "ended", "tilt"], "rmse": [0.2, 0.01, 0.1, 0.5], "steps": [9, 5, 9, 7]}
    )
    assert list(badness(frame)) == [2.0, 4.0, 1.0, 3.0]


def test_what_does_not_vary_or_nothing_flown_has_no_rank():
    frame = flights(5).assign(mass=1.0)
    assert influences(frame, ["mass", "flight.seed"]) == []
