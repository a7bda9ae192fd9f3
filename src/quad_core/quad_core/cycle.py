"""One cycle of the closed loop: its time, what acts in it, whether its numbers may be flown and its reference followed.

Time is counted in plant steps of integer nanoseconds; seconds are made here and only here.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from quad_core.geometry import ZERO, dot
from quad_core.records import leaves
from quad_core.types import (
    ALL_ROTORS,
    NO_LINK_FAULT,
    NO_PAYLOAD,
    NO_SENSOR_FAULT,
    Conditions,
    Disturbance,
    PositionInternals,
    SensorFault,
    Vec3,
    VehicleState,
)


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


def pushed(force_w: Vec3, torque_b: Vec3) -> Conditions:
    """Return conditions with an outer force N (world) and torque N m (body), all else calm."""
    return Conditions(
        force_w=force_w,
        torque_b=torque_b,
        wind_w=ZERO,
        payload=NO_PAYLOAD,
        rotor_effectiveness=ALL_ROTORS,
        thrust_limit=1.0,
        sensor=NO_SENSOR_FAULT,
        link=NO_LINK_FAULT,
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
        payload_mass=conditions.payload.mass,
        sensor_frozen=sensor.frozen,
        sensor_offset_w=sensor.offset_w,
        sensor_yaw_offset=sensor.yaw_offset,
        link_delay=link.delay,
        link_lost=link.lost,
    )


def is_faulty(fault: SensorFault) -> bool:
    """Return whether ``fault`` changes a reading."""
    offset = fault.offset_w
    return fault.frozen or offset.x != 0.0 or offset.y != 0.0 or offset.z != 0.0 or fault.yaw_offset != 0.0


INFEASIBLE_ERROR = 1.0  # m from the reference with the position law at a limit,
INFEASIBLE_TIME = 2.0  # for longer than this, s
LIMIT_FLAGS = tuple(name for name in PositionInternals._fields if name.endswith("_limited"))


class Behind(NamedTuple):
    """Since when the vehicle has been behind, and when that had first lasted longer than INFEASIBLE_TIME.

    Both are stamps of states in ns, -1: not.
    """

    since_ns: int = -1
    infeasible_ns: int = -1


def is_behind(internals: PositionInternals) -> bool:
    """Return whether the law met a limit in this step, farther than INFEASIBLE_ERROR from its reference."""
    limited = (
        internals.velocity_limited
        or internals.acceleration_limited
        or internals.tilt_limited
        or internals.thrust_limited
        or internals.descent_limited
    )
    error = internals.position_error
    return limited and dot(error, error) > INFEASIBLE_ERROR * INFEASIBLE_ERROR


def never_behind(_: Any) -> bool:
    """Return False: whose internals have no errors or no limits cannot be judged by them."""
    return False


def behind_check(kind: type[Any]) -> Callable[[Any], bool]:
    """Return ``is_behind`` for internals of ``kind``, ``never_behind`` where it lacks a field that counts."""
    return is_behind if {"position_error", *LIMIT_FLAGS} <= {*kind._fields} else never_behind


def followed(behind: Behind, behind_now: bool, stamp_ns: int) -> Behind:
    """Return ``behind`` after the state of ``stamp_ns``."""
    since, infeasible = behind
    if not behind_now:
        since = -1
    elif since < 0:
        since = stamp_ns
    elif infeasible < 0 and (stamp_ns - since) / 1e9 > INFEASIBLE_TIME:
        infeasible = stamp_ns
    return Behind(since, infeasible)


def finite_check(kind: type[Any]) -> Callable[[Any], bool]:
    """Return a function that tells whether every number of a ``kind`` is finite, as plain text that Numba compiles.

    The node and the loop without ROS both use it, so that they refuse the same answers at the same step.
    """
    terms = [f"value.{leaf.name}" for leaf in leaves(kind) if leaf.kind is float]
    each = " and ".join(f"math.isfinite({term})" for term in terms) or "True"
    # a balanced sum is quick and enough, but for finite numbers that overflow it
    text = f"def is_finite(value):\n    return math.isfinite({_balanced(terms) or '0.0'}) or ({each})\n"
    scope: dict[str, Any] = {"math": math}
    exec(compile(text, __file__, "exec"), scope)
    check: Callable[[Any], bool] = scope["is_finite"]
    check.__module__ = __name__
    check.__qualname__ = f"is_finite[{kind.__module__}.{kind.__qualname__}]"
    return check


def _balanced(terms: Sequence[str]) -> str:
    if len(terms) < 2:
        return "".join(terms)
    half = len(terms) // 2
    return f"({_balanced(terms[:half])} + {_balanced(terms[half:])})"
