"""The paper's proof for one axis of ABFNITSM with all its terms: what eqs. 57-59 are for the law as it is.

In flight the bounds Q of the proof and D_A are unknown: the law logs
``sliding_control.lyapunov`` and ``sliding_control.lyapunov_rate``. These functions are for tests and studies.
"""

from quad_attitude_ctrl.sliding_control import AdaptationForm, Estimates, saturation


def lyapunov_total(known: float, bounds: Estimates, estimates: Estimates, gains: Estimates) -> float:
    """Return l_phi of Eq. 57.

    ``known`` is ``sliding_control.lyapunov``; ``bounds`` Q_phi1..3, ``estimates`` Q_hat_phi1..3, ``gains``
    Delta_phi1..3 > 0.
    """
    constant = bounds.constant - estimates.constant
    angle = bounds.angle - estimates.angle
    rate = bounds.rate - estimates.rate
    return known + 0.5 * (constant * constant / gains.constant + angle * angle / gains.angle + rate * rate / gains.rate)


def lyapunov_total_rate(
    known_rate: float,
    sliding: float,
    shortfall: float,
    disturbance: float,
    form: int,
    dead_zone: float,
    width: float,
) -> float:
    """Return l_phi' (Eq. 58) along the law's own motion, in place of Eq. 59.

    ``known_rate`` is ``sliding_control.lyapunov_rate``, ``shortfall`` Phi - Phi_hat and ``disturbance`` D_A in
    rad/s^2, ``form``, ``dead_zone`` and ``width`` those of eqs. 54 and 55: within its dead zone no estimate moves.
    """
    total = known_rate + sliding * disturbance
    size = abs(sliding)
    if size <= dead_zone:
        return total
    drive = size if form == AdaptationForm.ABS else sliding * saturation(sliding, width)
    return total - shortfall * drive
