"""Disturbance ``none``: still air."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.types import CALM, Conditions
from quad_core.vehicle import Vehicle


class Parameters(NamedTuple):
    """No parameters."""


def draw(parameters: Parameters, vehicle: Vehicle, seed: int, duration: float) -> NDArray[np.float64]:  # noqa: ARG001
    """Return one row of zeros, shape (1, 6)."""
    return np.zeros((1, 6))


def sample(parameters: Parameters, table: NDArray[np.float64], time: float) -> Conditions:  # noqa: ARG001
    """Return a calm day."""
    return CALM
