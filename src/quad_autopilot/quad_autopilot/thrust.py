"""From newtons to an autopilot's thrust 0..1, whatever curve it takes the motors to have.

A curve says u -> thrust / T_m = k u^2 + (1 - k) u for a motor signal u, 0..1: PX4's THR_MDL_FAC, ArduPilot's
MOT_THST_EXPO. The autopilot inverts the curve that it assumes; the motors follow the true one.
"""

import math

from quad_core.geometry import clamp
from quad_core.parameters import ParameterError
from quad_core.types import Actuation, Rotors
from quad_core.vehicle import Vehicle

RESERVE = 1.05  # least thrust over weight
_SLACK = 1e-9


def signal(fraction: float, factor: float) -> float:
    """Return the motor signal u, 0..1, at which factor u^2 + (1 - factor) u = ``fraction`` of the largest thrust."""
    linear = 1.0 - factor
    divisor = linear + math.sqrt(linear * linear + 4.0 * factor * fraction)
    return 2.0 * fraction / divisor if divisor > 0.0 else 0.0


def compensated(assumed: float, true: float, fraction: float) -> float:
    """Return what an autopilot needs for ``fraction`` (0..1) of the largest thrust; equal curves leave it as it is."""
    if assumed == true:
        return fraction
    u = signal(clamp(fraction, 0.0, 1.0), true)
    return assumed * u * u + (1.0 - assumed) * u


def require(max_rotor_thrust: float, page: str, key: str = "max_rotor_thrust") -> None:
    """Raise ParameterError, which names ``key`` and ``page``, where the largest thrust of a rotor was not given."""
    if max_rotor_thrust <= 0.0:
        raise ParameterError(f"{key}: found 0.0, expected the largest thrust of one rotor in N; {page}")


def predicted(newtons: float, max_rotor_thrust: float) -> Actuation:
    """Return what four equal rotors make of a thrust in N: a prediction; torque and speeds are unknown and 0."""
    made = clamp(newtons, 0.0, 4.0 * max_rotor_thrust)
    each = 0.25 * made
    return Actuation(
        rotor_thrust=Rotors(each, each, each, each),
        thrust=made,
        thrust_high=made < newtons - _SLACK,
        thrust_low=made > newtons + _SLACK,
    )


def weakness(vehicle: Vehicle, max_rotor_thrust: float, key: str) -> str:
    """Return why four rotors of ``max_rotor_thrust`` N (parameter ``key``) cannot lift it; empty if they can."""
    available = 4.0 * max_rotor_thrust
    if available >= RESERVE * vehicle.mass * vehicle.gravity:
        return ""
    return f"{key}: four rotors give {available:g} N, too little for {vehicle.mass:g} kg"
