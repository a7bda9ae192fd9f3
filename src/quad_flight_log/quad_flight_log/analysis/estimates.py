"""The laws' estimates and the truth: sliding variables, adaptive bounds, disturbance estimates.

Tables as in ``quad_flight_log.analysis.metrics``. A law that lacks a quantity records zeros; such a metric is None.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.analysis.arrays import Floats, Stamps, aligned, by_stamp, euler_angles, euler_rates

ATTITUDE = "attitude_controller/internals"
POSITION = "position_controller/internals"
SURFACE_BOUND = 0.3  # rad/s, dead zone of Eq. 55
SURFACE_DWELL = 1.0  # s


class Estimate(NamedTuple):
    """An estimate and the truth at the same stamps, both (n, 3), axes as in the message."""

    stamp_ns: Stamps
    estimate: Floats
    truth: Floats


def adaptive_bound(tables: Mapping[str, NDArray[np.void]]) -> Estimate | None:
    """Return Phi_hat = Q_hat_1 + Q_hat_2 abs(x_1) + Q_hat_3 abs(x_2) (Eq. 60) and abs(D_A), both in rad/s^2.

    The angles and their rates are those of ``truth``. None if a topic is missing or the law adapts nothing.
    """
    if not {ATTITUDE, "disturbance", "truth"} <= tables.keys():
        return None
    inside, lumped, truth = (by_stamp(tables[name]) for name in (ATTITUDE, "disturbance", "truth"))
    names = ("adaptive_constant", "adaptive_angle", "adaptive_rate")
    if not _has(inside, *names):
        return None
    first = aligned(inside["stamp_ns"], lumped["stamp_ns"])
    second = aligned(first.stamp_ns, truth["stamp_ns"])
    inside, lumped = inside[first.left[second.left]], lumped[first.right[second.left]]
    truth = truth[second.right]
    constant, angle, rate = (inside[name] for name in names)
    angles = euler_angles(truth["q_wb"])
    bound = constant + angle * np.abs(angles) + rate * np.abs(euler_rates(angles, truth["omega_b"]))
    return Estimate(second.stamp_ns, bound, np.abs(lumped["lumped_angular_acceleration_b"]))


def disturbance_estimate(tables: Mapping[str, NDArray[np.void]]) -> Estimate | None:
    """Return the position law's estimate of d and the recorded D_P, both in m/s^2, world frame; None as above."""
    if not {POSITION, "disturbance"} <= tables.keys():
        return None
    inside, lumped = by_stamp(tables[POSITION]), by_stamp(tables["disturbance"])
    if not _has(inside, "disturbance_estimate"):
        return None
    match = aligned(inside["stamp_ns"], lumped["stamp_ns"])
    estimate = inside["disturbance_estimate"][match.left]
    return Estimate(match.stamp_ns, estimate, lumped["lumped_acceleration_w"][match.right])


def sliding(tables: Mapping[str, NDArray[np.void]]) -> tuple[Stamps, Floats] | None:
    """Return stamps and sliding variables (n, 3) in rad/s (Eq. 45); None for other laws."""
    if ATTITUDE not in tables:
        return None
    inside = by_stamp(tables[ATTITUDE])
    return (inside["stamp_ns"], inside["sliding_variable"]) if _has(inside, "sliding_variable") else None


def reaching_time(
    times: Floats, values: Floats, bound: float = SURFACE_BOUND, dwell: float = SURFACE_DWELL
) -> float | None:
    """Return the time from ``times[0]`` until all abs(values), (n, m), are below ``bound`` and stay so for ``dwell`` s.

    None if they never do; the end of the data ends a stay.
    """
    below = np.all(np.abs(values) < bound, axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], below, [False]])))
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if times[end - 1] - times[begin] >= dwell:
            return float(times[begin] - times[0])
    return None


def estimate_metrics(tables: Mapping[str, NDArray[np.void]], start_ns: int) -> dict[str, float | None]:
    """Return the metrics of this module from ``start_ns`` on."""
    values: dict[str, float | None] = {}
    surface = sliding(tables)
    if surface is not None:
        stamps, s = surface
        since = stamps >= start_ns
        times = (stamps[since] - start_ns).astype(np.float64) * 1e-9
        values["surface_reaching_time"] = reaching_time(times, s[since])
    bound = adaptive_bound(tables)
    if bound is not None:
        since = bound.stamp_ns >= start_ns
        short = np.any(bound.truth[since] > bound.estimate[since], axis=1)
        values["adaptive_bound_shortfall"] = float(np.mean(short)) if len(short) else None
    found = disturbance_estimate(tables)
    if found is not None:
        error = (found.estimate - found.truth)[found.stamp_ns >= start_ns]
        values["disturbance_estimate_rmse"] = float(np.sqrt(np.sum(error * error) / len(error))) if len(error) else None
    return values


def _has(table: NDArray[np.void], *names: str) -> bool:
    return all(name in (table.dtype.names or ()) for name in names) and any(table[name].any() for name in names)
