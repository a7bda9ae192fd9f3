"""From an attitude and a thrust in N to the fields of SET_ATTITUDE_TARGET.

::

    type_mask  7: attitude, body rates ignored          128: body rates, attitude ignored
    q          FRD in NED, wxyz                         rates: FRD, rad/s
    thrust     T / (4 T_m) through the thrust curves, 0..1

ArduPilot multiplies the thrust by 1 / cos(tilt) (ATC_ANGLE_BOOST), which is undone here.
"""

from typing import NamedTuple

from quad_autopilot import frames, thrust
from quad_core.geometry import body_z, clamp
from quad_core.types import AttitudeThrust, Quat, Vec3, VehicleState
from quad_mavlink.parameters import MavlinkBridgeParameters, MavlinkMode

ATTITUDE_ONLY, RATES_ONLY = 7, 128
_LEAST_COSINE = 0.1  # ArduPilot boosts no further


class AttitudeTarget(NamedTuple):
    """The fields of SET_ATTITUDE_TARGET: q as wxyz of FRD in NED, FRD rates in rad/s, thrust 0..1."""

    type_mask: int
    q: tuple[float, float, float, float]
    rates: Vec3
    thrust: float


def fraction(settings: MavlinkBridgeParameters, newtons: float) -> float:
    """Return what the autopilot needs for a collective thrust in N: 0..1."""
    share = clamp(newtons / (4.0 * settings.max_rotor_thrust), 0.0, 1.0)
    return clamp(thrust.compensated(settings.autopilot_curve, settings.thrust_curve, share), 0.0, 1.0)


def target(
    settings: MavlinkBridgeParameters, setpoint: AttitudeThrust, state: VehicleState, boosts: bool
) -> AttitudeTarget:
    """Return the target for ``setpoint`` at ``state``; ``boosts``: the autopilot divides thrust by cos(tilt)."""
    by_rates = settings.mode == MavlinkMode.RATES
    tilted = state.q_wb if by_rates else setpoint.q_wb
    newtons = setpoint.thrust * (clamp(body_z(tilted).z, _LEAST_COSINE, 1.0) if boosts else 1.0)
    if by_rates:
        turn = frames.body(thrust.rates(setpoint, state.q_wb, settings.rate_gain, settings.rate_limit))
        return AttitudeTarget(RATES_ONLY, _wxyz(state.q_wb), turn, fraction(settings, newtons))
    return AttitudeTarget(ATTITUDE_ONLY, _wxyz(setpoint.q_wb), Vec3(0.0, 0.0, 0.0), fraction(settings, newtons))


def _wxyz(q: Quat) -> tuple[float, float, float, float]:
    x, y, z, w = frames.attitude(q)
    return w, x, y, z
