"""When a reference asks for more than the vehicle has: the position law at a limit and far behind, without a break."""

from collections.abc import Callable
from typing import Any, NamedTuple

from quad_core.geometry import dot
from quad_core.types import PositionInternals

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
