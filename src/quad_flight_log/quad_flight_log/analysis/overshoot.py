"""How far a vehicle goes beyond the corners and yaw steps of its reference."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from quad_flight_log.analysis.arrays import Floats, aligned, euler_angles, norms, wrapped

OVERSHOOT_WINDOW = 5.0  # s
VELOCITY_STEP = 0.1  # m/s
YAW_STEP = 0.1  # rad


def overshoot_metrics(truth: NDArray[np.void], reference: NDArray[np.void]) -> dict[str, float | None]:
    """Return corner_overshoot in m and yaw_overshoot in rad; None where the reference has no corner or yaw step.

    ``truth``, ``reference``: sorted tables of these topics; overshoot is looked for in the steps of the reference.
    """
    match = aligned(truth["stamp_ns"], reference["stamp_ns"])
    truth, reference = truth[match.left], reference[match.right]
    if not {"v_w", "yaw"} <= set(reference.dtype.names or ()):
        return {}
    times = np.asarray(match.stamp_ns * 1e-9, dtype=np.float64)
    return {
        "corner_overshoot": corner_overshoot(times, truth["p_w"], reference["p_w"], reference["v_w"]),
        "yaw_overshoot": yaw_overshoot(times, euler_angles(truth["q_wb"])[:, 2], reference["yaw"]),
    }


def corner_overshoot(times: Floats, position: Floats, desired: Floats, desired_velocity: Floats) -> float | None:
    """Return the farthest that any corner was passed by, in m along the direction of arrival, >= 0; (n, 3) arrays.

    A corner is a jump of the reference's velocity that is larger than VELOCITY_STEP, arrived at in motion.
    """
    jumps = np.flatnonzero(norms(np.diff(desired_velocity, axis=0)) > VELOCITY_STEP) + 1
    found = None
    for jump, end in _windows(times, jumps):
        arrival = desired_velocity[jump - 1]
        speed = float(np.linalg.norm(arrival))
        if speed > 0.0:
            beyond = (position[jump:end] - desired[jump]) @ (arrival / speed)
            found = max(0.0, float(beyond.max()), found or 0.0)
    return found


def yaw_overshoot(times: Floats, yaw: Floats, desired: Floats) -> float | None:
    """Return the farthest that yaw went beyond a step of its reference, in rad, >= 0; (n,) arrays of angles."""
    change = wrapped(np.diff(desired))
    found = None
    for jump, end in _windows(times, np.flatnonzero(np.abs(change) > YAW_STEP) + 1):
        beyond = np.sign(change[jump - 1]) * wrapped(yaw[jump:end] - desired[jump])
        # half a turn and more is the way to the step, not beyond it
        found = max(0.0, float(np.where(beyond < np.pi / 2.0, beyond, 0.0).max()), found or 0.0)
    return found


def _windows(times: Floats, jumps: NDArray[np.intp]) -> Iterator[tuple[int, int]]:
    """Yield first and last (excluded) index after each jump: until the next one, at most OVERSHOOT_WINDOW long."""
    for jump, following in zip(jumps, [*jumps[1:], len(times)][: len(jumps)], strict=True):
        late = int(np.searchsorted(times, times[jump] + OVERSHOOT_WINDOW))
        yield int(jump), min(int(following), late)
