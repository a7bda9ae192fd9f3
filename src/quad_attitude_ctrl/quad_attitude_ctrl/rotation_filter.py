"""Command filter on SO(3): a desired attitude with its body rates and their derivative, at any attitude.

    (d/dt + b)^3 per body axis of the filter's own frame, towards the set attitude q_set

The way to go is split as PX4 splits it (Brescianini, Hehn and D'Andrea, 2013): the shortest turn about a horizontal
body axis that points the thrust where it shall point, and what is left as a turn about the thrust. Each axis has its
own bandwidth, so that a slow yaw does not delay the thrust. Near level it is ``command.next_filter_state`` of each
angle.
The input moves by at most ``max_rate`` per axis. A tilt or a turn of more than ``widest`` rad counts as that much:
within a bandwidth b, then, no more than about 0.3 widest b^2 rad/s^2 is asked for.
"""

import math
from typing import NamedTuple

from quad_attitude_ctrl.command import FilterState, Shaping, next_filter_state
from quad_core.geometry import ZERO, clamp, relative_attitude, turned
from quad_core.types import Quat, Vec3

IDENTITY = Quat(0.0, 0.0, 0.0, 1.0)


class RotationState(NamedTuple):
    """Filtered attitude, its body rates in rad/s and their derivative in rad/s^2, and its rate-limited input."""

    attitude: Quat = Quat()
    rates: Vec3 = Vec3()
    accelerations: Vec3 = Vec3()
    target: Quat = Quat()


def at_rest(attitude: Quat) -> RotationState:
    """Return the filter at rest at ``attitude``."""
    return RotationState(attitude, ZERO, ZERO, attitude)


def next_rotation(state: RotationState, target: Quat, shaping: Shaping, widest: float, dt: float) -> RotationState:
    """Return the filter one step of ``dt`` s later; ``target`` is the set attitude, ``widest`` in rad."""
    roll, pitch, yaw = shaping.roll, shaping.pitch, shaping.yaw
    way = way_to(relative_attitude(state.target, target))
    step = Vec3(
        clamp(way.x, -roll.max_rate * dt, roll.max_rate * dt),
        clamp(way.y, -pitch.max_rate * dt, pitch.max_rate * dt),
        clamp(way.z, -yaw.max_rate * dt, yaw.max_rate * dt),
    )
    reached = target
    if step.x != way.x or step.y != way.y or step.z != way.z:
        # the thrust first, then the turn about it: as the way is measured
        reached = turned(turned(state.target, Vec3(step.x, step.y, 0.0)), Vec3(0.0, 0.0, step.z))
    left = way_to(relative_attitude(state.attitude, reached))
    tilt = math.sqrt(left.x * left.x + left.y * left.y)
    share = widest / tilt if tilt > widest else 1.0
    # the turn counts apart: a long one must not shorten the tilt
    left = Vec3(share * left.x, share * left.y, clamp(left.z, -widest, widest))
    v, a = state.rates, state.accelerations
    x = next_filter_state(FilterState(0.0, v.x, a.x, left.x), left.x, roll.bandwidth, 1e6, dt)
    y = next_filter_state(FilterState(0.0, v.y, a.y, left.y), left.y, pitch.bandwidth, 1e6, dt)
    z = next_filter_state(FilterState(0.0, v.z, a.z, left.z), left.z, yaw.bandwidth, 1e6, dt)
    return RotationState(
        turned(state.attitude, Vec3(x.angle, y.angle, z.angle)),
        Vec3(x.rate, y.rate, z.rate),
        Vec3(x.acceleration, y.acceleration, z.acceleration),
        reached,
    )


def way_to(q: Quat) -> Vec3:
    """Return the turn that ``q`` is as (tilt about body x, tilt about body y, turn about the tilted z), rad.

    Each is within (-pi, pi]. Upside down the axis of the tilt is that of ``q``; else body x.
    """
    twist = math.sqrt(q.z * q.z + q.w * q.w)
    swing = math.sqrt(q.x * q.x + q.y * q.y)
    tilt = 2.0 * math.atan2(swing, twist)
    if twist < 1e-9:
        return Vec3(tilt * q.x / swing, tilt * q.y / swing, 0.0)
    turn = 2.0 * math.atan2(q.z, q.w)
    if turn > math.pi:
        turn -= 2.0 * math.pi
    if turn <= -math.pi:
        turn += 2.0 * math.pi
    if swing < 1e-9:
        return Vec3(2.0 * (q.w * q.x - q.y * q.z) / twist, 2.0 * (q.w * q.y + q.x * q.z) / twist, turn)
    # q = swing * twist, so the swing is q twist^-1
    x, y = (q.x * q.w - q.y * q.z) / twist, (q.y * q.w + q.x * q.z) / twist
    return Vec3(tilt * x / swing, tilt * y / swing, turn)
