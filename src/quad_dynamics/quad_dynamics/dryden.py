"""Dryden turbulence of MIL-F-8785C near the ground: intensities, scales, and an exact discrete-time realisation.

Frozen field: turbulence is carried past the vehicle at one constant air speed V. With T = L / V the one-sided spectra
over w in rad/s are (the integral of each is sigma^2)::

    along:        sigma^2 (2 T / pi) / (1 + (T w)^2)
    across, up:   sigma^2 (T / pi) (1 + 3 (T w)^2) / (1 + (T w)^2)^2
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FOOT = 0.3048
LOWEST, HIGHEST = 10.0, 1000.0
"""Heights in feet between which the low-altitude form holds."""


class Turbulence(NamedTuple):
    """Standard deviations m/s and time scales s along, across (horizontally) and up."""

    sigma: tuple[float, float, float]
    scale: tuple[float, float, float]


def low_altitude(altitude: float, wind_at_6_m: float, air_speed: float) -> Turbulence:
    """Return intensities and time scales at ``altitude`` m, held between 10 and 1000 feet.

    ``wind_at_6_m``: mean wind in m/s 20 feet above the ground; ``air_speed``: V in m/s, more than 0.
    """
    feet = min(max(altitude / FOOT, LOWEST), HIGHEST)
    shear = 0.177 + 0.000823 * feet
    length, height = FOOT * feet / shear**1.2, FOOT * feet
    up = 0.1 * wind_at_6_m
    level = up / shear**0.4
    return Turbulence((level, level, up), (length / air_speed, length / air_speed, height / air_speed))


def realisation(
    turbulence: Turbulence, streams: list[np.random.Generator], count: int, period: float
) -> NDArray[np.float64]:
    """Return ``count`` samples ``period`` s apart, shape (count, 3), m/s along, across and up; stationary at once.

    ``streams``: one generator for each column. A longer realisation begins like a shorter one.
    """
    columns = []
    for axis, stream in enumerate(streams):
        normals = stream.standard_normal((count, 2)).tolist()
        sigma, scale = turbulence.sigma[axis], turbulence.scale[axis]
        filtered = _first_order if axis == 0 else _second_order
        columns.append(filtered(sigma, scale, normals, period))
    return np.array(columns).T


def _first_order(sigma: float, scale: float, normals: list[list[float]], period: float) -> list[float]:
    stay = math.exp(-period / scale)
    fresh = sigma * math.sqrt(1.0 - stay * stay)
    value = sigma * normals[0][0]
    found: list[float] = []
    for normal, _ in normals:
        if found:
            value = stay * value + fresh * normal
        found.append(value)
    return found


def _second_order(sigma: float, scale: float, normals: list[list[float]], period: float) -> list[float]:
    """Two lags in a row, y1' = (xi - y1) / T and y2' = (y1 - y2) / T, read as sigma sqrt(T) (y2 + sqrt(3) (y1 - y2)).

    Time is counted in T and y in 1 / sqrt(T), so that T drops out.
    """
    a = period / scale
    stay = math.exp(-a)
    left = stay * stay
    start = _root(0.5, 0.25, 0.25)
    fresh = _root(
        0.5 * (1.0 - left), 0.25 * (1.0 - left * (1.0 + 2.0 * a)), 0.25 * (1.0 - left * (1.0 + 2.0 * a * (1.0 + a)))
    )
    y1, y2 = 0.0, 0.0
    found: list[float] = []
    for first, second in normals:
        (l11, l21, l22), moved = (fresh, stay) if found else (start, 0.0)
        y1, y2 = moved * y1 + l11 * first, moved * (a * y1 + y2) + l21 * first + l22 * second
        found.append(sigma * (y2 + math.sqrt(3.0) * (y1 - y2)))
    return found


def _root(q11: float, q12: float, q22: float) -> tuple[float, float, float]:
    """Return l11, l21, l22 of the lower triangular root of a covariance."""
    l11 = math.sqrt(q11)
    l21 = q12 / l11
    return l11, l21, math.sqrt(max(q22 - l21 * l21, 0.0))
