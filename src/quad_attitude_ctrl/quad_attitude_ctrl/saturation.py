"""The paper's differentiable saturation function (Eq. 39)."""

import math


def saturation(x: float, width: float) -> float:
    """Return tanh(x / (2 ``width``)); ``width`` = 1 is sat(x) = (e^x - 1)/(e^x + 1) of Eq. 39 without its overflow.

    ``width`` > 0 scales the boundary layer (same unit as x); the slope at 0 is 1/(2 width).
    """
    return math.tanh(0.5 * x / width)
