"""Bounds: where the laws may be called, and holding a number in a range."""

from quad_core.types import VehicleState

POSITION_BOUND = 1e4
VELOCITY_BOUND = 1e3
BODY_RATE_BOUND = 1e3
QUATERNION_SQUARE_TOLERANCE = 2e-3


def clamp(value: float, low: float, high: float) -> float:
    """Return ``value`` held in [``low``, ``high``] (same unit, low <= high); a NaN stays a NaN."""
    if value < low:
        return low
    if value > high:
        return high
    return value


def is_flyable(state: VehicleState) -> bool:
    """Return whether the laws may be called with ``state``: finite, and each component within its bound.

    abs(p_w) <= 1e4 m, abs(v_w) <= 1e3 m/s, abs(omega_b) <= 1e3 rad/s, quaternion norm 1 +- 1e-3.
    A flight whose state is not flyable has diverged.
    """
    p, v, q, omega = state.p_w, state.v_w, state.q_wb, state.omega_b
    # every comparison is false for a NaN, so a NaN is never flyable
    return (
        abs(p.x) <= POSITION_BOUND
        and abs(p.y) <= POSITION_BOUND
        and abs(p.z) <= POSITION_BOUND
        and abs(v.x) <= VELOCITY_BOUND
        and abs(v.y) <= VELOCITY_BOUND
        and abs(v.z) <= VELOCITY_BOUND
        and abs(omega.x) <= BODY_RATE_BOUND
        and abs(omega.y) <= BODY_RATE_BOUND
        and abs(omega.z) <= BODY_RATE_BOUND
        and abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0) <= QUATERNION_SQUARE_TOLERANCE
    )
