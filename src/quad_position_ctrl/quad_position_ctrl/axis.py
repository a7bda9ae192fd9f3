"""AIBS on one axis: gains, command (eqs. 18, 23, 25, 30) and update (eqs. 21, 37)."""

from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_position_ctrl.backstepping import (
    acceleration_command,
    adaptive_rate,
    bounded_acceleration_command,
    next_adaptive_gain,
    tracking_error,
    virtual_velocity,
)


class Axis(NamedTuple):
    """Gains of one axis; named after the x axis, the same on y (9, 10) and z (11, 12)."""

    position_gain: Annotated[float, Real("1/s", "xi_7", 0.01, 100.0, "Table 2, Eq. 23")] = 4.25
    integral_gain: Annotated[float, Real("1/s^2", "k_7", 0.0, 100.0, "Table 2, Eq. 23")] = 0.01
    max_integral: Annotated[float, Real("m s", "bound of Gamma_7; 1e9: off", 0.0, 1e9, "addition to Eq. 21")] = 20.0
    adaptation_rate: Annotated[float, Real("s/m^2", "alpha_8; 0: fixed gain", 0.0, 1e4, "Table 2, Eq. 37")] = 2.5
    initial_gain: Annotated[
        float, Real("1/s", "xi_hat_8(0), which the paper does not give", 0.0, 1e3, "assumed, Eq. 37")
    ] = 7.0
    max_gain: Annotated[float, Real("1/s", "bound of xi_hat_8; 1e9: off", 0.0, 1e9, "addition to Eq. 37")] = 10.0
    adaptation_leak: Annotated[
        float,
        Real("1/s", "rate at which xi_hat_8 returns to xi_hat_8(0); 0: as printed", 0.0, 100.0, "addition to Eq. 37"),
    ] = 0.05


class Motion(NamedTuple):
    """What the vehicle and the reference do along one axis: m, m/s, m/s^2."""

    position: float
    velocity: float
    reference_position: float
    reference_velocity: float
    reference_acceleration: float


class Correction(NamedTuple):
    """One axis of the bounded correction of Eq. 23: m/s, its derivative m/s^2, its shortening and whether it is any."""

    velocity: float
    rate: float
    scale: float
    limited: bool


class AxisCommand(NamedTuple):
    """One axis of eqs. 18, 23, 25 and 30: e_7 in m, x_8d in m/s, e_8 in m/s, U_x in m/s^2."""

    error: float
    virtual_velocity: float
    velocity_error: float
    acceleration: float


def axis_command(
    axis: Axis,
    adaptive_gain: float,
    integral: float,
    drag: float,
    motion: Motion,
    correction: Correction,
    disturbance: float,
) -> AxisCommand:
    """Return eqs. 18, 23, 25 and 30 of one axis, or their bounded form where ``correction`` is limited.

    ``adaptive_gain`` xi_hat_8 in 1/s, ``integral`` Gamma_7 in m s, ``drag`` a_7 in 1/s, ``disturbance`` in m/s^2.
    """
    error = tracking_error(motion.position, motion.reference_position)
    if correction.limited:
        virtual = motion.reference_velocity + correction.velocity
        velocity_error = tracking_error(motion.velocity, virtual)
        acceleration = bounded_acceleration_command(
            adaptive_gain,
            drag,
            correction.scale * error,
            velocity_error,
            motion.velocity,
            motion.reference_acceleration + correction.rate,
            disturbance,
        )
        return AxisCommand(error, virtual, velocity_error, acceleration)
    virtual = virtual_velocity(axis.position_gain, axis.integral_gain, error, integral, motion.reference_velocity)
    velocity_error = tracking_error(motion.velocity, virtual)
    acceleration = acceleration_command(
        axis.position_gain,
        axis.integral_gain,
        adaptive_gain,
        drag,
        error,
        velocity_error,
        integral,
        motion.velocity,
        motion.reference_acceleration,
        disturbance,
    )
    return AxisCommand(error, virtual, velocity_error, acceleration)


def updated_gain(axis: Axis, gain: float, velocity_error: float, dt: float) -> float:
    """Return xi_hat_8 in 1/s after a step of ``dt`` s (Eq. 37 with leak and bound)."""
    rate = adaptive_rate(axis.adaptation_rate, velocity_error)
    return next_adaptive_gain(gain, rate, axis.adaptation_leak, axis.initial_gain, axis.max_gain, dt)
