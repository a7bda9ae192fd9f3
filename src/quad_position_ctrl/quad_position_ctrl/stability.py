"""The paper's proof for one axis of AIBS with all its terms: what is true of eqs. 31-36 with and without disturbance.

In flight the gain xi_8 of the proof and d are unknown: the law logs
``backstepping.lyapunov`` and ``backstepping.lyapunov_rate``. These functions are for tests and studies.
Exact for an exact state, an attitude that follows at once, and no limit met.
"""

import math


def lyapunov_total(known: float, true_gain: float, adaptive_gain: float, adaptation_rate: float) -> float:
    """Return L_Px of Eq. 31 (and one axis of Eq. 35).

    ``known`` is ``backstepping.lyapunov``; ``true_gain`` xi_8 and ``adaptive_gain`` xi_hat_8 in 1/s;
    ``adaptation_rate`` alpha_8 > 0 in s/m^2.
    """
    shortfall = true_gain - adaptive_gain
    return known + 0.5 * shortfall * shortfall / adaptation_rate


def lyapunov_total_rate(
    position_gain: float, true_gain: float, position_error: float, velocity_error: float, disturbance: float
) -> float:
    """Return L_Px' = -xi_7 e_7^2 - xi_8 e_8^2 + e_8 d (Eq. 34, which leaves the last term out).

    ``disturbance`` d in m/s^2 less what the law puts in its place in Eq. 30. Positive for small e_8 of the sign of d.
    """
    return (
        -position_gain * position_error * position_error
        - true_gain * velocity_error * velocity_error
        + velocity_error * disturbance
    )


def rate_bound(
    position_gain: float, true_gain: float, position_error: float, velocity_error: float, max_disturbance: float
) -> float:
    """Return -xi_7 e_7^2 - xi_8 e_8^2 / 2 + D^2 / (2 xi_8), which L_Px' never exceeds for abs(d) <= D.

    It stands where Eq. 34 says <= 0. By completing the square (Young's inequality); ``true_gain`` > 0.
    """
    return (
        -position_gain * position_error * position_error
        - 0.5 * true_gain * velocity_error * velocity_error
        + 0.5 * max_disturbance * max_disturbance / true_gain
    )


def largest_errors(position_gain: float, true_gain: float, max_disturbance: float) -> tuple[float, float]:
    """Return the half axes of the ellipse on which ``rate_bound`` is 0: abs(e_7) in m, abs(e_8) in m/s.

    Outside of it L_Px falls for every abs(d) <= D.
    """
    return (
        max_disturbance / math.sqrt(2.0 * position_gain * true_gain),
        max_disturbance / true_gain,
    )


def static_error(position_gain: float, adaptive_gain: float, disturbance: float) -> float:
    """Return e_7 in m at rest under a constant d in m/s^2 while the integral of Eq. 21 does nothing.

    Eqs. 19 and 29 at rest: e_8 = xi_7 e_7 and e_7 + xi_hat_8 e_8 = d.
    """
    return disturbance / (1.0 + position_gain * adaptive_gain)


def lyapunov_rate_limit(
    position_gain: float, lowest_gain: float, position_error: float, velocity_error: float, max_disturbance: float
) -> float:
    """Return -xi_7 e_7^2 - xi_low e_8^2 + D abs(e_8): W' of W = (e_7^2 + k Gamma^2 + e_8^2) / 2 never exceeds it.

    For abs(d) <= D and whatever moves xi_hat_8 (leak, dead zone, projection, freezing) as long as it stays at or above
    ``lowest_gain``, which all of them do from xi_hat_8(0) = ``lowest_gain`` on; and while Gamma moves by Eq. 21 or
    rests at its bound.
    """
    return (
        -position_gain * position_error * position_error
        - lowest_gain * velocity_error * velocity_error
        + max_disturbance * abs(velocity_error)
    )


def ultimate_error(
    position_gain: float, integral_gain: float, lowest_gain: float, max_integral: float, max_disturbance: float
) -> float:
    """Return the length of (e_7, e_8) that is not exceeded in the end: sqrt(k G^2 + D^2 / (c xi_low)).

    c = min(2 xi_7, xi_low), G = ``max_integral`` in m s: W' <= -c (W - k G^2 / 2) + D^2 / (2 xi_low).
    """
    rate = min(2.0 * position_gain, lowest_gain)
    return math.sqrt(
        integral_gain * max_integral * max_integral + max_disturbance * max_disturbance / (rate * lowest_gain)
    )
