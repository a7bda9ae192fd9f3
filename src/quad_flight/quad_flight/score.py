"""The figures of a flight, counted while it flies, so that a campaign needs no logs."""

import math
from typing import NamedTuple

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
    dx = state.p_w.x - reference.p_w.x
    dy = state.p_w.y - reference.p_w.y
    dz = state.p_w.z - reference.p_w.z
    squared = dx * dx + dy * dy + dz * dz
    error = math.sqrt(squared)
    largest = error if error > score.largest_error else score.largest_error
    return Score(score.samples + 1, score.squared_error + squared, largest, error, score.torque_variation)


def with_torque_change(score: Score, before: Vec3, now: Vec3) -> Score:
    """Return ``score`` with the change of the commanded torque from ``before`` to ``now`` in N m counted in."""
    change = abs(now.x - before.x) + abs(now.y - before.y) + abs(now.z - before.z)
    return Score(
        score.samples, score.squared_error, score.largest_error, score.last_error, score.torque_variation + change
    )
