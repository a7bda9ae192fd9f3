"""Adaptive integral backstepping, one scalar function per equation and axis (eqs. 18-37).

Written with the x axis in mind (e_7, e_8, xi_7, k_7, alpha_8, a_7); y and z are the same law with the indices
9, 10, a_8 and 11, 12, a_9. World frame, SI units. Every function is pure text (decision record 0001).
"""


def tracking_error(actual: float, desired: float) -> float:
    """Return e_7 = x_7 - x_7d in m (Eq. 18), and e_8 = x_8 - x_8d in m/s (Eq. 25): the same difference."""
    return actual - desired


def correction_velocity(position_gain: float, integral_gain: float, position_error: float, integral: float) -> float:
    """Return -xi_7 e_7 - k_7 Gamma_7 in m/s: what Eq. 23 adds to the reference velocity."""
    return -position_gain * position_error - integral_gain * integral


def virtual_velocity(
    position_gain: float, integral_gain: float, position_error: float, integral: float, reference_velocity: float
) -> float:
    """Return x_8d = -xi_7 e_7 + x_7d' - k_7 Gamma_7 in m/s (Eq. 23)."""
    return correction_velocity(position_gain, integral_gain, position_error, integral) + reference_velocity


def drag_model(drag_coefficient: float, mass: float, drag_sign: int) -> float:
    """Return a_7 in 1/s (Eq. 17): -k_F/m, or +k_F/m as printed when ``drag_sign`` is 1."""
    if drag_sign == 1:
        return drag_coefficient / mass
    return -drag_coefficient / mass


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


def next_adaptive_gain(gain: float, rate: float, leak: float, initial_gain: float, max_gain: float, dt: float) -> float:
    """Return xi_hat_8 one step later, forward Euler, kept in [0, ``max_gain``].

    Eq. 37 plus two additions: a leak towards xi_hat_8(0) (the sigma modification of Ioannou and Kokotovic, 1984)
    and a bound (projection; Ioannou and Sun, Robust Adaptive Control, 1996). Leak 0 and a huge bound give Eq. 37.
    """
    moved = gain + dt * (rate - leak * (gain - initial_gain))
    if moved > max_gain:
        return max_gain
    if moved < 0.0:
        return 0.0
    return moved


def next_integral(integral: float, position_error: float, max_integral: float, dt: float) -> float:
    """Return Gamma_7 in m s one step later (Eq. 21), forward Euler, kept within +-``max_integral``."""
    moved = integral + dt * position_error
    if moved > max_integral:
        return max_integral
    if moved < -max_integral:
        return -max_integral
    return moved


def lyapunov(integral_gain: float, position_error: float, velocity_error: float, integral: float) -> float:
    """Return one axis of L_P (Eq. 35) without the estimation-error term, which nobody can know in flight."""
    return 0.5 * (
        position_error * position_error + integral_gain * integral * integral + velocity_error * velocity_error
    )


def lyapunov_rate(position_gain: float, adaptive_gain: float, position_error: float, velocity_error: float) -> float:
    """Return one axis of L_P' = -xi_7 e_7^2 - xi_8 e_8^2 (Eq. 36), with xi_hat_8 in the place of xi_8.

    True for d = 0 and an attitude that follows at once; a disturbance d adds e_8 d.
    """
    return -position_gain * position_error * position_error - adaptive_gain * velocity_error * velocity_error
