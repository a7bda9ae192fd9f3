"""One cycle of the closed loop: its time, what acts in it, whether its numbers may be flown and its reference followed.

Time is counted in plant steps of integer nanoseconds; seconds are made here and only here.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from quad_core.geometry import dot
from quad_core.types import Conditions, Disturbance, PositionInternals, Vec3, VehicleState


def seconds(steps: int, plant_period: int) -> float:
    """Return the time of ``steps`` plant steps of ``plant_period`` ns in s, correctly rounded (``* 1e-9`` is not)."""
    return steps * plant_period / 1e9


def steps_to_cover(duration: float, plant_period: int) -> int:
    """Return the fewest plant steps (at least 1) that cover ``duration`` s, to a millionth of a step."""
    count = math.ceil(duration * 1e9 / plant_period - 1e-6)
    if count < 1:
        return 1
    return count


POSITION_BOUND = 1e4
VELOCITY_BOUND = 1e3
BODY_RATE_BOUND = 1e3
QUATERNION_SQUARE_TOLERANCE = 2e-3


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


def as_disturbance(conditions: Conditions, acceleration_w: Vec3, angular_acceleration_b: Vec3) -> Disturbance:
    """Return what is published: ``conditions`` with D_P in m/s^2 (world) and D_A in rad/s^2 (body) of Eqs. 10-12."""
    sensor, link = conditions.sensor, conditions.link
    return Disturbance(
        force_w=conditions.force_w,
        torque_b=conditions.torque_b,
        lumped_acceleration_w=acceleration_w,
        lumped_angular_acceleration_b=angular_acceleration_b,
        wind_w=conditions.wind_w,
        rotor_effectiveness=conditions.rotor_effectiveness,
        thrust_limit=conditions.thrust_limit,
        payload_mass=conditions.payload_mass,
        sensor_frozen=sensor.frozen,
        sensor_offset_w=sensor.offset_w,
        sensor_yaw_offset=sensor.yaw_offset,
        link_delay=link.delay,
        link_lost=link.lost,
    )


INFEASIBLE_ERROR = 1.0  # m from the reference with the position law at a limit,
INFEASIBLE_TIME = 2.0  # without coming nearer for longer than this in s,
PROGRESS = 0.1  # m by which the least error has to fall to count as nearer
LIMIT_FLAGS = tuple(name for name in PositionInternals._fields if name.endswith("_limited"))


class ReferenceLag(NamedTuple):
    """The spell in which the vehicle is behind its reference: times are stamps of states in ns, -1: none.

    ``since_ns``: when the spell began. ``least``: the least error in m, ``nearer_ns``: when it last fell by PROGRESS.
    ``infeasible_ns``: when it had first not fallen for longer than INFEASIBLE_TIME.
    """

    since_ns: int = -1
    nearer_ns: int = -1
    least: float = 0.0
    infeasible_ns: int = -1


def distance_behind(internals: PositionInternals) -> float:
    """Return the position error in m if the law met a limit in this step and it exceeds INFEASIBLE_ERROR, else 0."""
    limited = (
        internals.velocity_limited
        or internals.acceleration_limited
        or internals.tilt_limited
        or internals.thrust_limited
        or internals.descent_limited
    )
    error = internals.position_error
    square = dot(error, error)
    if limited and square > INFEASIBLE_ERROR * INFEASIBLE_ERROR:
        return math.sqrt(square)
    return 0.0


def never_behind(_: Any) -> float:
    """Return 0: internals without errors or limits show no distance."""
    return 0.0


def lag_check(kind: type[Any]) -> Callable[[Any], float]:
    """Return ``distance_behind`` for internals of ``kind``, ``never_behind`` where it lacks a field that counts."""
    return distance_behind if {"position_error", *LIMIT_FLAGS} <= {*kind._fields} else never_behind


def limits_met(internals: PositionInternals) -> str:
    """Return the names of the limits that the law met in this step, for example ``tilt, thrust``."""
    return ", ".join(name.removesuffix("_limited") for name in LIMIT_FLAGS if getattr(internals, name))


def followed(behind: ReferenceLag, distance: float, stamp_ns: int) -> ReferenceLag:
    """Return ``behind`` after the state of ``stamp_ns``, at which the vehicle was ``distance`` m behind (0: not)."""
    if distance == 0.0:
        return ReferenceLag(-1, -1, 0.0, behind.infeasible_ns)
    if behind.since_ns < 0:
        return ReferenceLag(stamp_ns, stamp_ns, distance, behind.infeasible_ns)
    if distance < behind.least - PROGRESS:
        return ReferenceLag(behind.since_ns, stamp_ns, distance, behind.infeasible_ns)
    infeasible = behind.infeasible_ns
    if infeasible < 0 and (stamp_ns - behind.nearer_ns) / 1e9 > INFEASIBLE_TIME:
        infeasible = stamp_ns
    return ReferenceLag(behind.since_ns, behind.nearer_ns, behind.least, infeasible)
