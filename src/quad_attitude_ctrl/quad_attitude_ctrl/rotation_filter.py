"""Command filter on SO(3): what laws without Euler angles follow, a desired attitude with its rates, at any attitude.

    psi' ...     heading: ``command.next_filter_state`` of the set yaw, with yaw's bandwidth and largest rate
    q_set        the set attitude, turned about its own thrust axis from the set yaw to that heading
    (d/dt + b)^3 towards q_set per body axis of the filter's own frame; about the thrust with roll's b

The way to go is split as PX4 splits it (Brescianini, Hehn and D'Andrea, 2013): the shortest turn about a horizontal
body axis that points the thrust where it shall point, and what is left as a turn about the thrust. A slow heading
delays the thrust by nothing, and the turns that tilting itself asks for at a constant yaw are not slow. Near level it
is the filter of each angle. The input tilts by at most ``max_rate`` per axis. A way of more than ``widest`` rad counts
as that much: within a bandwidth b, then, no more than about 0.3 widest b^2 rad/s^2 is asked for. What the setpoint's
own rates lead the input by (``CommandSource.LED``) is added after that.
"""

import math
from typing import Annotated, NamedTuple

from quad_attitude_ctrl.command import CommandFilter, CommandSource, Desired, FilterState, led, next_filter_state
from quad_attitude_ctrl.torque import body_acceleration
from quad_core.geometry import (
    ZERO,
    add,
    body_rates,
    clamp,
    euler_from_quaternion,
    normalized,
    quaternion_from_euler,
    relative_attitude,
    rotate,
    rotate_inverse,
    rotated_by_vector,
    scale,
    wrap_angle,
)
from quad_core.parameters import Choice, Real
from quad_core.types import AttitudeThrust, Quat, Vec3

IDENTITY = Quat(0.0, 0.0, 0.0, 1.0)

Widest = Annotated[
    float, Real("rad", "longest way that the filter sees; larger: faster large turns", 0.01, 6.3, "addition")
]


class RotationShaping(NamedTuple):
    """Where the desired attitude's rates and accelerations come from; yaw's filter is that of the heading."""

    command: Annotated[
        int, Choice(CommandSource, "derivatives of the desired attitude: command filter, setpoint, zero", "addition")
    ] = CommandSource.FILTER.value
    roll: CommandFilter = CommandFilter()
    pitch: CommandFilter = CommandFilter()
    yaw: CommandFilter = CommandFilter(bandwidth=8.0, max_rate=1.5)
    widest: Widest = 0.6


class RotationState(NamedTuple):
    """Filtered attitude, its body rates in rad/s and their derivative in rad/s^2, rate-limited input, heading."""

    attitude: Quat = Quat()
    rates: Vec3 = Vec3()
    accelerations: Vec3 = Vec3()
    target: Quat = Quat()
    heading: FilterState = FilterState()


NO_ROTATION = RotationState(IDENTITY, ZERO, ZERO, IDENTITY, FilterState(0.0, 0.0, 0.0, 0.0))
"""What is remembered before the first step."""


class Goal(NamedTuple):
    """Desired attitude, its body rates in rad/s and their derivative in rad/s^2, in its own body axes."""

    attitude: Quat
    rates: Vec3
    accelerations: Vec3


def at_rest(attitude: Quat, setpoint: AttitudeThrust) -> RotationState:
    """Return the filter at rest at ``attitude``; the heading is the one that ``setpoint`` needs no turn for."""
    turn = swing_twist(relative_attitude(attitude, set_attitude(setpoint))).z
    psi = wrap_angle(setpoint.angles.z - turn)
    return RotationState(attitude, ZERO, ZERO, attitude, FilterState(psi, 0.0, 0.0, psi))


def goal_of(source: int, filtered: RotationState, setpoint: AttitudeThrust) -> Goal:
    """Return what the law follows; ``source`` is a ``CommandSource``."""
    if source == CommandSource.FEED_FORWARD:
        return set_goal(setpoint)
    if source == CommandSource.RAW:
        return Goal(set_attitude(setpoint), ZERO, ZERO)
    return Goal(filtered.attitude, filtered.rates, filtered.accelerations)


def filter_and_goal(
    shaping: RotationShaping, state: RotationState, is_initialised: bool, q_wb: Quat, setpoint: AttitudeThrust
) -> tuple[RotationState, Goal]:
    """Return the filter of this step, at rest at ``q_wb`` in the first one, and what the law follows."""
    filtered = state if is_initialised else at_rest(q_wb, setpoint)
    return filtered, goal_of(shaping.command, filtered, setpoint)


def set_attitude(setpoint: AttitudeThrust) -> Quat:
    """Return the attitude of the setpoint as a unit quaternion, that of its angles where it names none."""
    q = setpoint.q_wb
    if 0.5 < q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w < 2.0:
        return normalized(q)
    return quaternion_from_euler(setpoint.angles)


def set_goal(setpoint: AttitudeThrust) -> Goal:
    """Return the setpoint with its derivatives, in body axes: exact where the thrust is tilted in the set heading."""
    angles, v, a = setpoint.angles, setpoint.rates, setpoint.accelerations
    return Goal(set_attitude(setpoint), body_rates(angles, v), body_acceleration(angles, v, a))


def about_thrust(goal: Goal, turn: float) -> Goal:
    """Return ``goal`` turned by ``turn`` rad about its own thrust axis, its motion in the world unchanged."""
    other = Quat(0.0, 0.0, math.sin(0.5 * turn), math.cos(0.5 * turn))
    return Goal(
        rotated_by_vector(goal.attitude, Vec3(0.0, 0.0, turn)),
        rotate_inverse(other, goal.rates),
        rotate_inverse(other, goal.accelerations),
    )


def as_angles(goal: Goal) -> Desired:
    """Return ``goal`` as internals show it: its Euler angles, but rates and accelerations of its body axes."""
    return Desired(euler_from_quaternion(goal.attitude), goal.rates, goal.accelerations)


def next_rotation(shaping: RotationShaping, state: RotationState, setpoint: AttitudeThrust, dt: float) -> RotationState:
    """Return the filter one step of ``dt`` s later."""
    roll, pitch, yaw, psi = shaping.roll, shaping.pitch, shaping.yaw, setpoint.angles.z
    v, a = setpoint.rates, setpoint.accelerations
    ahead = led(shaping.command, psi, v.z, a.z, yaw.bandwidth)
    heading = next_filter_state(state.heading, ahead, yaw.bandwidth, yaw.max_rate, dt)
    goal = about_thrust(set_goal(setpoint), wrap_angle(heading.angle - psi))
    reached = _moved(state.target, goal.attitude, roll.max_rate * dt, pitch.max_rate * dt)
    left = swing_twist(relative_attitude(state.attitude, reached))
    tilt = math.sqrt(left.x * left.x + left.y * left.y)
    share = shaping.widest / tilt if tilt > shaping.widest else 1.0
    # the turn counts apart: a long one must not shorten the tilt
    way = Vec3(share * left.x, share * left.y, clamp(left.z, -shaping.widest, shaping.widest))
    if shaping.command == CommandSource.LED:
        b = roll.bandwidth
        lead = scale(3.0 / b, add(goal.rates, scale(1.0 / b, goal.accelerations)))
        way = add(way, rotate(Quat(0.0, 0.0, math.sin(0.5 * left.z), math.cos(0.5 * left.z)), lead))
    v, a = state.rates, state.accelerations
    x = next_filter_state(FilterState(0.0, v.x, a.x, way.x), way.x, roll.bandwidth, 1e6, dt)
    y = next_filter_state(FilterState(0.0, v.y, a.y, way.y), way.y, pitch.bandwidth, 1e6, dt)
    z = next_filter_state(FilterState(0.0, v.z, a.z, way.z), way.z, roll.bandwidth, 1e6, dt)
    return RotationState(
        rotated_by_vector(state.attitude, Vec3(x.angle, y.angle, z.angle)),
        Vec3(x.rate, y.rate, z.rate),
        Vec3(x.acceleration, y.acceleration, z.acceleration),
        reached,
        heading,
    )


def _moved(target: Quat, goal: Quat, most_x: float, most_y: float) -> Quat:
    """Return ``goal`` approached from ``target`` by at most ``most_x`` and ``most_y`` rad of tilt, the turn whole."""
    way = swing_twist(relative_attitude(target, goal))
    x, y = clamp(way.x, -most_x, most_x), clamp(way.y, -most_y, most_y)
    if x == way.x and y == way.y:
        return goal
    # the thrust first, then the turn about it: as the way is measured
    return rotated_by_vector(rotated_by_vector(target, Vec3(x, y, 0.0)), Vec3(0.0, 0.0, way.z))


def swing_twist(q: Quat) -> Vec3:
    """Return the turn that ``q`` is as (tilt about body x, tilt about body y, turn about the tilted z), rad.

    Each is within (-pi, pi]. Upside down the axis of the tilt is that of ``q``; else body x.
    """
    twist = math.sqrt(q.z * q.z + q.w * q.w)
    swing = math.sqrt(q.x * q.x + q.y * q.y)
    tilt = 2.0 * math.atan2(swing, twist)
    if twist < 1e-9:
        return Vec3(tilt * q.x / swing, tilt * q.y / swing, 0.0)
    turn = wrap_angle(2.0 * math.atan2(q.z, q.w))
    if swing < 1e-9:
        return Vec3(2.0 * (q.w * q.x - q.y * q.z) / twist, 2.0 * (q.w * q.y + q.x * q.z) / twist, turn)
    # q = swing * twist, so the swing is q twist^-1
    x, y = (q.x * q.w - q.y * q.z) / twist, (q.y * q.w + q.x * q.z) / twist
    return Vec3(tilt * x / swing, tilt * y / swing, turn)
