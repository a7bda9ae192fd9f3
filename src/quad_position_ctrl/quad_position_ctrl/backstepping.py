"""Adaptive integral backstepping on one axis: a scalar function per equation (eqs. 18-37), then the whole axis.

The equations stand in ``aibs``. Written with the x axis in mind (e_7, e_8, xi_7, k_7, alpha_8, a_7); y and z are the
same law with the indices 9, 10, a_8 and 11, 12, a_9. World frame, SI units. Every function is pure text (decision
record 0001).
"""

from typing import Annotated, NamedTuple

from quad_core.geometry import clamp
from quad_core.parameters import Real
from quad_core.types import TrajectoryPoint, VehicleState
from quad_position_ctrl.speed_limit import AxisCorrection


def tracking_error(actual: float, desired: float) -> float:
    """Return e_7 = x_7 - x_7d in m (Eq. 18), and e_8 = x_8 - x_8d in m/s (Eq. 25): the same difference."""
    return actual - desired


def correction_velocity(position_gain: float, integral_gain: float, position_error: float, integral: float) -> float:
    """Return -xi_7 e_7 - k_7 Gamma_7 in m/s: what Eq. 23 adds to the reference velocity."""
    return -position_gain * position_error - integral_gain * integral


def virtual_velocity(correction: float, reference_velocity: float) -> float:
    """Return x_8d = x_7d' - xi_7 e_7 - k_7 Gamma_7 in m/s (Eq. 23).

    ``correction`` is that of ``correction_velocity`` in m/s, bounded or not; ``reference_velocity`` x_7d' in m/s.
    """
    return correction + reference_velocity


def acceleration_command(
    position_gain: float,
    integral_gain: float,
    adaptive_gain: float,
    drag: float,
    position_error: float,
    velocity_error: float,
    integral: float,
    velocity: float,
    reference_acceleration: float,
    disturbance: float,
) -> float:
    """Return U_x in m/s^2 (Eq. 30).

    ``drag`` is a_7 in 1/s, ``adaptive_gain`` xi_hat_8 in 1/s. The paper's d_x is unknown to a controller:
    ``disturbance`` is an estimate of it in m/s^2, or 0.
    """
    return (
        reference_acceleration
        + (position_gain * position_gain - 1.0 - integral_gain) * position_error
        - (position_gain + adaptive_gain) * velocity_error
        - drag * velocity
        + position_gain * integral_gain * integral
        - disturbance
    )


def bounded_acceleration_command(
    adaptive_gain: float,
    drag: float,
    bounded_error: float,
    velocity_error: float,
    velocity: float,
    virtual_acceleration: float,
    disturbance: float,
) -> float:
    """Return U_x in m/s^2 where the virtual velocity of Eq. 23 is bounded.

    The backstepping step of eqs. 27-29 once more, with x_8d' (``virtual_acceleration``, m/s^2) of the bounded x_8d and
    with e_7 scaled as the correction was (``bounded_error``, m). Without a bound it is Eq. 30.
    """
    return virtual_acceleration - bounded_error - adaptive_gain * velocity_error - drag * velocity - disturbance


def adaptive_rate(adaptation_rate: float, velocity_error: float) -> float:
    """Return xi_hat_8' = alpha_8 e_8^2 in 1/s^2 (Eq. 37, as Eq. 33)."""
    return adaptation_rate * velocity_error * velocity_error


def adapting_error(velocity_error: float, dead_zone: float) -> float:
    """Return the e_8 that Eq. 37 is given in m/s: its size less ``dead_zone``, 0 within it (an addition).

    Noise of at most ``dead_zone`` on e_8 then never raises xi_hat. Source: dead zone of Peterson and Narendra,
    IEEE TAC 27(6), 1982, in its continuous form.
    """
    size = abs(velocity_error)
    return size - dead_zone if size > dead_zone else 0.0


def next_adaptive_gain(gain: float, rate: float, leak: float, initial_gain: float, max_gain: float, dt: float) -> float:
    """Return xi_hat_8 in 1/s one step later, forward Euler, within [0, ``max_gain``].

    Eq. 37 plus two additions: a leak towards xi_hat_8(0) (the sigma modification of Ioannou and Kokotovic, 1984)
    and a bound (projection; Ioannou and Sun, Robust Adaptive Control, 1996). Leak 0 and a huge bound give Eq. 37.
    """
    return clamp(gain + dt * (rate - leak * (gain - initial_gain)), 0.0, max_gain)


def next_integral(integral: float, position_error: float, max_integral: float, dt: float) -> float:
    """Return Gamma_7 in m s one step later (Eq. 21), forward Euler, within +-``max_integral``."""
    return clamp(integral + dt * position_error, -max_integral, max_integral)


def lyapunov(integral_gain: float, position_error: float, velocity_error: float, integral: float) -> float:
    """Return one axis of L_P (Eq. 35) without the estimation-error term, which is unknown in flight."""
    return 0.5 * (
        position_error * position_error + integral_gain * integral * integral + velocity_error * velocity_error
    )


def lyapunov_rate(position_gain: float, adaptive_gain: float, position_error: float, velocity_error: float) -> float:
    """Return one axis of L_P' = -xi_7 e_7^2 - xi_8 e_8^2 (Eq. 36), with xi_hat_8 in the place of xi_8.

    True for d = 0 and an attitude that follows at once; a disturbance d adds e_8 d.
    """
    return -position_gain * position_error * position_error - adaptive_gain * velocity_error * velocity_error


PositionGain = Annotated[
    float,
    Real("1/s", "position error to velocity, xi_7 (y: 9, z: 11); larger: stiffer", 0.01, 100.0, "Table 2, Eq. 23"),
]
IntegralGain = Annotated[
    float, Real("1/s^2", "gain of the integral, k_7 (y: 9, z: 11); 0: offsets stay", 0.0, 100.0, "Table 2, Eq. 23")
]
IntegralBound = Annotated[
    float, Real("m s", "bound of the integral Gamma_7 (y: 9, z: 11); 1e9: off", 0.0, 1e9, "addition to Eq. 21")
]


class AxisGains(NamedTuple):
    """Gains of one axis. The paper numbers them 7 and 8 on x, 9 and 10 on y, 11 and 12 on z."""

    position_gain: PositionGain = 4.25
    integral_gain: IntegralGain = 0.01
    max_integral: IntegralBound = 20.0
    adaptation_rate: Annotated[
        float, Real("s/m^2", "adaptation rate alpha_8 (y: 10, z: 12); 0: fixed gain", 0.0, 1e4, "Table 2, Eq. 37")
    ] = 2.5
    initial_gain: Annotated[
        float, Real("1/s", "adaptive gain at first, xi_hat_8(0) (y: 10, z: 12)", 0.0, 1e3, "assumed, Eq. 37")
    ] = 7.0
    max_gain: Annotated[float, Real("1/s", "bound of the adaptive gain; 1e9: off", 0.0, 1e9, "addition to Eq. 37")] = (
        10.0
    )
    adaptation_leak: Annotated[
        float, Real("1/s", "return rate to initial_gain; larger: faster; 0: printed", 0.0, 100.0, "addition to Eq. 37")
    ] = 0.05
    adaptation_dead_zone: Annotated[
        float, Real("m/s", "velocity error (noise) below which it rests; 0: off", 0.0, 100.0, "addition to Eq. 37")
    ] = 0.0


class AxisState(NamedTuple):
    """Vehicle and reference along one world axis: positions m, velocities m/s, acceleration m/s^2."""

    position: float
    velocity: float
    reference_position: float
    reference_velocity: float
    reference_acceleration: float


Axes = tuple[AxisState, AxisState, AxisState]  # vehicle and reference along x, y and z


class AxisCommand(NamedTuple):
    """One axis of eqs. 18, 23, 25, 30, 35 and 36: e_7 in m, x_8d in m/s, e_8 in m/s, U_x in m/s^2, its L_P and L_P'."""

    error: float
    virtual_velocity: float
    velocity_error: float
    acceleration: float
    lyapunov: float
    lyapunov_rate: float


def axis_states(state: VehicleState, reference: TrajectoryPoint) -> Axes:
    """Return what the equations of each axis look at."""
    p, v, p_d, v_d, a_d = state.p_w, state.v_w, reference.p_w, reference.v_w, reference.a_w
    return (
        AxisState(p.x, v.x, p_d.x, v_d.x, a_d.x),
        AxisState(p.y, v.y, p_d.y, v_d.y, a_d.y),
        AxisState(p.z, v.z, p_d.z, v_d.z, a_d.z),
    )


def axis_command(
    gains: AxisGains,
    state: AxisState,
    correction: AxisCorrection,
    adaptive_gain: float,
    integral: float,
    drag: float,
    disturbance: float,
) -> AxisCommand:
    """Return eqs. 18, 23, 25, 30, 35 and 36 of one axis, or their bounded form where ``correction`` is limited.

    ``adaptive_gain`` xi_hat_8 in 1/s, ``integral`` Gamma_7 in m s, ``drag`` a_7 in 1/s, ``disturbance`` in m/s^2.
    """
    error = tracking_error(state.position, state.reference_position)
    virtual = virtual_velocity(correction.velocity, state.reference_velocity)
    velocity_error = tracking_error(state.velocity, virtual)
    if correction.limited:
        bounded_error, virtual_acceleration = correction.scale * error, state.reference_acceleration + correction.rate
        acceleration = bounded_acceleration_command(
            adaptive_gain, drag, bounded_error, velocity_error, state.velocity, virtual_acceleration, disturbance
        )
    else:
        acceleration = acceleration_command(
            position_gain=gains.position_gain,
            integral_gain=gains.integral_gain,
            adaptive_gain=adaptive_gain,
            drag=drag,
            position_error=error,
            velocity_error=velocity_error,
            integral=integral,
            velocity=state.velocity,
            reference_acceleration=state.reference_acceleration,
            disturbance=disturbance,
        )
    level = lyapunov(gains.integral_gain, error, velocity_error, integral)
    rate = lyapunov_rate(gains.position_gain, adaptive_gain, error, velocity_error)
    return AxisCommand(error, virtual, velocity_error, acceleration, level, rate)


def updated_gain(gains: AxisGains, adaptive_gain: float, velocity_error: float, dt: float) -> float:
    """Return xi_hat_8 in 1/s after a step of ``dt`` s (Eq. 37 with dead zone, leak and bound).

    ``velocity_error`` e_8 in m/s.
    """
    rate = adaptive_rate(gains.adaptation_rate, adapting_error(velocity_error, gains.adaptation_dead_zone))
    return next_adaptive_gain(adaptive_gain, rate, gains.adaptation_leak, gains.initial_gain, gains.max_gain, dt)
