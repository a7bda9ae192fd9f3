"""From an attitude and a thrust in N to SET_ATTITUDE_TARGET: T / (4 T_m) through the thrust curves, 0..1.

ArduPilot multiplies the thrust by 1 / cos(tilt) (ATC_ANGLE_BOOST), which is undone here.
"""

from quad_autopilot import thrust
from quad_core.geometry import body_z, clamp
from quad_core.types import AttitudeThrust
from quad_mavlink.parameters import MavlinkBridgeParameters

_LEAST_COSINE = 0.1  # ArduPilot boosts no further


def fraction(settings: MavlinkBridgeParameters, setpoint: AttitudeThrust, boosts: bool) -> float:
    """Return what the autopilot needs for the thrust of ``setpoint``: 0..1; ``boosts``: it divides by cos(tilt)."""
    newtons = setpoint.thrust * (clamp(body_z(setpoint.q_wb).z, _LEAST_COSINE, 1.0) if boosts else 1.0)
    share = clamp(newtons / (4.0 * settings.max_rotor_thrust), 0.0, 1.0)
    return clamp(thrust.compensated(settings.autopilot_curve, settings.thrust_curve, share), 0.0, 1.0)
