"""What attitude laws follow: desired angles, rates and accelerations on three axes, from raw setpoints.

    (d/dt + bandwidth)^3 x_1d = bandwidth^3 target,   |target'| <= max_rate

The paper defines neither x_1d' nor x_1d''. Three equal poles at -bandwidth make a continuous acceleration of a
staircase. The step is the exact solution for an input held over it: stable at any bandwidth and rate. Source:
command-filtered backstepping, Farrell, Polycarpou, Sharma and Dong, IEEE TAC 54(6), 2009.

Laws with Euler angles share it, abfnitsm and itsm; those without share ``rotation_filter``, made of the same poles.
"""

import math
from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, clamp, wrap_angle
from quad_core.parameters import Choice, Real
from quad_core.types import AttitudeThrust, Vec3


class FilterState(NamedTuple):
    """Filtered angle in rad, rate in rad/s, acceleration in rad/s^2, and the rate-limited input ``target`` in rad."""

    angle: float = 0.0
    rate: float = 0.0
    acceleration: float = 0.0
    target: float = 0.0


def next_target(target: float, raw: float, max_rate: float, dt: float) -> float:
    """Return the input of the filter in rad: ``raw`` approached by at most ``max_rate`` rad/s, the short way round.

    With it the filter's output keeps within ``max_rate``, and its acceleration within 0.55 ``max_rate`` bandwidth.
    """
    max_way = max_rate * dt
    return target + clamp(wrap_angle(raw - target), -max_way, max_way)


def next_filter_state(state: FilterState, raw: float, bandwidth: float, max_rate: float, dt: float) -> FilterState:
    """Return the filter one step of ``dt`` s later; angle and target stay near (-pi, pi].

    ``raw`` setpoint in rad, ``bandwidth`` and ``max_rate`` in rad/s.
    """
    target = next_target(state.target, raw, max_rate, dt)
    shift = wrap_angle(target) - target
    decay = math.exp(-bandwidth * dt)
    c0 = state.angle - target
    c1 = state.rate + bandwidth * c0
    c2 = 0.5 * (state.acceleration + 2.0 * bandwidth * state.rate + bandwidth * bandwidth * c0)
    offset = decay * (c0 + (c1 + c2 * dt) * dt)
    rate = decay * (c1 - bandwidth * c0 + (2.0 * c2 - bandwidth * c1) * dt - bandwidth * c2 * dt * dt)
    acceleration = decay * (
        2.0 * c2
        - 2.0 * bandwidth * c1
        + bandwidth * bandwidth * c0
        + bandwidth * (bandwidth * c1 - 4.0 * c2) * dt
        + bandwidth * bandwidth * c2 * dt * dt
    )
    return FilterState(target + shift + offset, rate, acceleration, target + shift)


class CommandSource(IntEnum):
    """Where desired rates and accelerations come from: the command filter, the setpoint, or nowhere (zero).

    LED: the command filter, its input led by the setpoint's own rates and accelerations.
    """

    FILTER = 0
    FEED_FORWARD = 1
    RAW = 2
    LED = 3


class CommandFilter(NamedTuple):
    """Command filter of one axis."""

    bandwidth: Annotated[
        float,
        Real("rad/s", "bandwidth of the command filter (three equal poles); larger: faster", 0.1, 1e3, "addition"),
    ] = 40.0
    max_rate: Annotated[float, Real("rad/s", "largest rate of the filter input; 1e6: off", 0.01, 1e6, "addition")] = 1e6


class Shaping(NamedTuple):
    """Where desired rates and accelerations come from."""

    command: Annotated[
        int, Choice(CommandSource, "derivatives of the desired angles: command filter, setpoint, zero", "addition")
    ] = CommandSource.FILTER.value
    roll: CommandFilter = CommandFilter()
    pitch: CommandFilter = CommandFilter()
    yaw: CommandFilter = CommandFilter(bandwidth=8.0, max_rate=1.5)


class FilterStates(NamedTuple):
    """Command filters of the three axes."""

    roll: FilterState = FilterState()
    pitch: FilterState = FilterState()
    yaw: FilterState = FilterState()


class Desired(NamedTuple):
    """Desired Euler angles in rad, their rates in rad/s and accelerations in rad/s^2."""

    angles: Vec3
    rates: Vec3
    accelerations: Vec3


def filters_at_rest(angles: Vec3) -> FilterStates:
    """Return the filters at rest at ``angles`` in rad."""
    return FilterStates(
        FilterState(angles.x, 0.0, 0.0, angles.x),
        FilterState(angles.y, 0.0, 0.0, angles.y),
        FilterState(angles.z, 0.0, 0.0, angles.z),
    )


def desired(source: int, filters: FilterStates, setpoint: AttitudeThrust) -> Desired:
    """Return x_1d, x_1d' and x_1d'' of the three axes now; ``source`` is a ``CommandSource``."""
    if source == CommandSource.FEED_FORWARD:
        return Desired(setpoint.angles, setpoint.rates, setpoint.accelerations)
    if source == CommandSource.RAW:
        return Desired(setpoint.angles, ZERO, ZERO)
    roll, pitch, yaw = filters.roll, filters.pitch, filters.yaw
    return Desired(
        Vec3(roll.angle, pitch.angle, yaw.angle),
        Vec3(roll.rate, pitch.rate, yaw.rate),
        Vec3(roll.acceleration, pitch.acceleration, yaw.acceleration),
    )


def led(source: int, angle: float, rate: float, acceleration: float, bandwidth: float) -> float:
    """Return what the filter of ``bandwidth`` b is given for an angle r in rad: r, or for LED r + 3/b r' + 3/b^2 r".

    With the latter it answers r itself but for the third derivative over b^3; what the setpoint adds to the angle whose
    derivatives it carries is filtered as ever.
    """
    if source != CommandSource.LED:
        return angle
    return angle + (3.0 * rate + 3.0 * acceleration / bandwidth) / bandwidth


def next_filters(shaping: Shaping, filters: FilterStates, setpoint: AttitudeThrust, dt: float) -> FilterStates:
    """Return the filters one step of ``dt`` s later."""
    source, roll, pitch, yaw = shaping.command, shaping.roll, shaping.pitch, shaping.yaw
    angles, v, a = setpoint.angles, setpoint.rates, setpoint.accelerations
    raw = Vec3(
        led(source, angles.x, v.x, a.x, roll.bandwidth),
        led(source, angles.y, v.y, a.y, pitch.bandwidth),
        led(source, angles.z, v.z, a.z, yaw.bandwidth),
    )
    return FilterStates(
        next_filter_state(filters.roll, raw.x, roll.bandwidth, roll.max_rate, dt),
        next_filter_state(filters.pitch, raw.y, pitch.bandwidth, pitch.max_rate, dt),
        next_filter_state(filters.yaw, raw.z, yaw.bandwidth, yaw.max_rate, dt),
    )
