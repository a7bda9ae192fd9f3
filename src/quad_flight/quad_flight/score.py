"""How well a flight was flown, counted while it flies: what unlogged flights and campaigns show.

A new measure is a row of ``MEASURES``, with what it needs in ``Score`` and in the two functions that add to it.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from quad_core.geometry import dot, subtract
from quad_core.types import TrajectoryPoint, Vec3, VehicleState


class Score(NamedTuple):
    """Errors of truth against the reference at the steps of the trajectory with t >= ``score_from``; m, m^2.

    ``torque_variation``: sum of all changes of the commanded torque since then in N m, the three axes added.
    """

    samples: int
    squared_error: float
    largest_error: float
    last_error: float
    torque_variation: float


NOTHING_SCORED = Score(0, 0.0, 0.0, 0.0, 0.0)


def scored(score: Score, state: VehicleState, reference: TrajectoryPoint) -> Score:
    """Return ``score`` with the distance of ``state`` from ``reference`` counted in."""
    off = subtract(state.p_w, reference.p_w)
    squared = dot(off, off)
    error = math.sqrt(squared)
    largest = error if error > score.largest_error else score.largest_error
    return Score(score.samples + 1, score.squared_error + squared, largest, error, score.torque_variation)


def with_torque_change(score: Score, before: Vec3, now: Vec3) -> Score:
    """Return ``score`` with the change of the commanded torque from ``before`` to ``now`` in N m counted in."""
    change = abs(now.x - before.x) + abs(now.y - before.y) + abs(now.z - before.z)
    return Score(
        samples=score.samples,
        squared_error=score.squared_error,
        largest_error=score.largest_error,
        last_error=score.last_error,
        torque_variation=score.torque_variation + change,
    )


class Measure(NamedTuple):
    """A number of a flight: of its ``Score``, its unit, and the metric of a logged flight that is the same."""

    of: Callable[[Score], float]
    unit: str
    metric: str


MEASURES = {
    "rmse": Measure(
        lambda score: math.sqrt(score.squared_error / score.samples) if score.samples else math.nan,
        "m",
        "position_rmse",
    ),
    "largest_error": Measure(lambda score: score.largest_error, "m", "position_max"),
    "last_error": Measure(lambda score: score.last_error, "m", "position_final"),
    "torque_variation": Measure(lambda score: score.torque_variation, "N m", "torque_total_variation"),
}
"""{name in a campaign: measure}."""
