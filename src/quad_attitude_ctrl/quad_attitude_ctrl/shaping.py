"""What the baseline attitude laws share: shaped commands of the three axes and bounded torques.

Commands are shaped as ABFNITSM shapes them (``command_filter``), so that laws are compared on the same commands.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.abfnitsm import AxisFlags, Internals
from quad_attitude_ctrl.axis import COMMAND_FEED_FORWARD, COMMAND_FILTER, Filter
from quad_attitude_ctrl.command_filter import Command, next_command
from quad_core.parameters import Choice, Real
from quad_core.types import Actuation, AttitudeThrust, Vec3


class Shaping(NamedTuple):
    """Where desired rates and accelerations come from."""

    command: Annotated[
        int,
        Choice(
            ("filter", "feed_forward", "raw"),
            "derivatives of the desired angles: the command filter, the setpoint, or zero",
            "addition",
        ),
    ] = COMMAND_FILTER
    roll: Filter = Filter()
    pitch: Filter = Filter()
    yaw: Filter = Filter(bandwidth=8.0, max_rate=1.5)


class TorqueLimits(NamedTuple):
    """Largest torque about each body axis."""

    roll: Annotated[float, Real("N m", "largest torque about body x; 1e6: off", 0.0, 1e6, "addition")] = 0.5
    pitch: Annotated[float, Real("N m", "largest torque about body y; 1e6: off", 0.0, 1e6, "addition")] = 0.5
    yaw: Annotated[float, Real("N m", "largest torque about body z; 1e6: off", 0.0, 1e6, "addition")] = 0.5


class Commands(NamedTuple):
    """Command filters of the three axes."""

    roll: Command = Command()
    pitch: Command = Command()
    yaw: Command = Command()


class Desired(NamedTuple):
    """Desired Euler angles in rad, their rates in rad/s and accelerations in rad/s^2."""

    angles: Vec3
    rates: Vec3
    accelerations: Vec3


class HeldTorque(NamedTuple):
    """Torque in N m within its limits, and on which axes a limit was met."""

    torque: Vec3
    limited: AxisFlags


def commands_at(angles: Vec3) -> Commands:
    """Return the filters at rest at ``angles``."""
    return Commands(
        Command(angles.x, 0.0, 0.0, angles.x),
        Command(angles.y, 0.0, 0.0, angles.y),
        Command(angles.z, 0.0, 0.0, angles.z),
    )


def desired(shaping: Shaping, commands: Commands, setpoint: AttitudeThrust) -> Desired:
    """Return what to follow now."""
    if shaping.command == COMMAND_FEED_FORWARD:
        return Desired(setpoint.angles, setpoint.rates, setpoint.accelerations)
    if shaping.command != COMMAND_FILTER:
        zero = Vec3(0.0, 0.0, 0.0)
        return Desired(setpoint.angles, zero, zero)
    roll, pitch, yaw = commands.roll, commands.pitch, commands.yaw
    return Desired(
        Vec3(roll.angle, pitch.angle, yaw.angle),
        Vec3(roll.rate, pitch.rate, yaw.rate),
        Vec3(roll.acceleration, pitch.acceleration, yaw.acceleration),
    )


def next_commands(shaping: Shaping, commands: Commands, setpoint: AttitudeThrust, dt: float) -> Commands:
    """Return the filters one step of ``dt`` s later."""
    raw = setpoint.angles
    return Commands(
        next_command(commands.roll, raw.x, shaping.roll.bandwidth, shaping.roll.max_rate, dt),
        next_command(commands.pitch, raw.y, shaping.pitch.bandwidth, shaping.pitch.max_rate, dt),
        next_command(commands.yaw, raw.z, shaping.yaw.bandwidth, shaping.yaw.max_rate, dt),
    )


def held_torque(wanted: Vec3, limits: TorqueLimits) -> HeldTorque:
    """Return ``wanted`` in N m, each axis within its limit."""
    torque = Vec3(held(wanted.x, limits.roll), held(wanted.y, limits.pitch), held(wanted.z, limits.yaw))
    return HeldTorque(torque, AxisFlags(torque.x != wanted.x, torque.y != wanted.y, torque.z != wanted.z))


def held(value: float, most: float) -> float:
    """Return ``value`` within +-``most``."""
    if value > most:
        return most
    if value < -most:
        return -most
    return value


def resting(anti_windup: bool, limited: AxisFlags, actuation: Actuation) -> AxisFlags:
    """Return on which axes integrals must rest: a limit is met in the law, or was met by the vehicle."""
    return AxisFlags(
        anti_windup and (limited.x or actuation.roll_limited),
        anti_windup and (limited.y or actuation.pitch_limited),
        anti_windup and (limited.z or actuation.yaw_limited),
    )


def surfaceless_internals(
    goal: Desired, error: Vec3, error_rate: Vec3, ahead: Vec3, feedback: Vec3, bounded: HeldTorque, rest: AxisFlags
) -> Internals:
    """Return the internals of a law without sliding surface and adaptation: what it has of them, zero for the rest.

    ``error`` rad, ``error_rate`` rad/s, ``ahead`` and ``feedback`` the two parts of the command.
    """
    zero = Vec3(0.0, 0.0, 0.0)
    return Internals(
        desired_angles=goal.angles,
        desired_rates=goal.rates,
        desired_accelerations=goal.accelerations,
        angle_error=error,
        rate_error=error_rate,
        sliding_variable=zero,
        surface_integral=zero,
        surface_exponent=zero,
        adaptive_constant=zero,
        adaptive_angle=zero,
        adaptive_rate=zero,
        equivalent_control=ahead,
        reaching_control=feedback,
        lyapunov=zero,
        lyapunov_rate=zero,
        torque_limited=bounded.limited,
        adaptation_frozen=rest,
    )
