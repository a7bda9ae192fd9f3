"""Command filter of one angle: x_1d, x_1d' and x_1d'' from raw setpoints (the paper defines neither derivative).

Three equal poles at -bandwidth, so that a staircase in gives a continuous acceleration out. The step is the exact
solution for an input held over it: stable at any bandwidth and rate. Source: command-filtered backstepping, Farrell,
Polycarpou, Sharma and Dong, IEEE TAC 54(6), 2009.
"""

import math
from typing import NamedTuple

from quad_core.rotations import wrap_angle


class Command(NamedTuple):
    """Filtered angle in rad, rate in rad/s, acceleration in rad/s^2, and the rate-limited input ``target`` in rad."""

    angle: float = 0.0
    rate: float = 0.0
    acceleration: float = 0.0
    target: float = 0.0


def next_target(target: float, raw: float, max_rate: float, dt: float) -> float:
    """Return the input of the filter in rad: ``raw`` approached by at most ``max_rate`` rad/s, the short way round.

    With it the filter's output keeps within ``max_rate``, and its acceleration within 0.55 ``max_rate`` bandwidth.
    """
    way = wrap_angle(raw - target)
    most = max_rate * dt
    if way > most:
        return target + most
    if way < -most:
        return target - most
    return target + way


def next_command(command: Command, raw: float, bandwidth: float, max_rate: float, dt: float) -> Command:
    """Return the filter one step of ``dt`` s later; ``bandwidth`` in rad/s. Angle and target stay near (-pi, pi]."""
    target = next_target(command.target, raw, max_rate, dt)
    shift = wrap_angle(target) - target
    decay = math.exp(-bandwidth * dt)
    c0 = command.angle - target
    c1 = command.rate + bandwidth * c0
    c2 = 0.5 * (command.acceleration + 2.0 * bandwidth * command.rate + bandwidth * bandwidth * c0)
    offset = decay * (c0 + (c1 + c2 * dt) * dt)
    rate = decay * (c1 - bandwidth * c0 + (2.0 * c2 - bandwidth * c1) * dt - bandwidth * c2 * dt * dt)
    acceleration = decay * (
        2.0 * c2
        - 2.0 * bandwidth * c1
        + bandwidth * bandwidth * c0
        + bandwidth * (bandwidth * c1 - 4.0 * c2) * dt
        + bandwidth * bandwidth * c2 * dt * dt
    )
    return Command(target + shift + offset, rate, acceleration, target + shift)
