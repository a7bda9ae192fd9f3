"""From an attitude and a thrust in N to a Crazyflie's manual setpoint, and from its log block to an estimate.

::

    thrust direction in the heading frame  s = R_z(-yaw) z_d
    roll = asin(-s_y)     pitch = atan2(s_x, s_z)     yaw rate = gain (yaw_d - yaw)
    thrust16 = 65535 u(T / (4 T_m)) = 10001 + percent (60000 - 10001) / 100

Angles as cflib takes them: FLU, degrees; pitch > 0 is nose down (cflib turns its sign on the wire), yaw rate > 0 is
counter-clockwise. 0 % is thrust16 10001: rotors stand only by the zero setpoint that also unlocks the thrust.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from quad_autopilot import frames, thrust
from quad_autopilot.odometry import NED, Sample
from quad_core.geometry import body_z, clamp, euler_from_quaternion, wrap_angle
from quad_core.types import AttitudeThrust, Quat, Vec3, VehicleState
from quad_crazyflie.parameters import CrazyflieBridgeParameters

LEAST, LARGEST, WHOLE = 10001.0, 60000.0, 65535.0  # thrust16 at 0 %, at 100 %, and of the largest thrust
_SHORTS = ("x", "y", "z", "vx", "vy", "vz", "rateRoll", "ratePitch", "rateYaw")
BLOCK = {
    **{f"stateEstimateZ.{name}": "int16_t" for name in _SHORTS},
    "stateEstimateZ.quat": "uint32_t",
    "pm.vbatMV": "uint16_t",
    "supervisor.info": "uint16_t",
}
"""One log block of 26 bytes, all that a packet takes: mm, mm/s, a packed quaternion, mrad/s, mV, flags."""
_PART = 511


class Manual(NamedTuple):
    """A manual setpoint as cflib takes it: deg, deg/s, percent."""

    roll: float
    pitch: float
    yaw_rate: float
    percent: float


def manual(settings: CrazyflieBridgeParameters, setpoint: AttitudeThrust, state: VehicleState) -> Manual:
    """Return the setpoint that points the thrust where ``setpoint`` wants it, at the heading of ``state``."""
    yaw, desired = euler_from_quaternion(state.q_wb).z, euler_from_quaternion(setpoint.q_wb).z
    z = body_z(setpoint.q_wb)
    forward = math.cos(yaw) * z.x + math.sin(yaw) * z.y
    left = -math.sin(yaw) * z.x + math.cos(yaw) * z.y
    limit = settings.tilt_limit
    roll = clamp(math.asin(clamp(-left, -1.0, 1.0)), -limit, limit)
    pitch = clamp(math.atan2(forward, z.z), -limit, limit)
    turn = settings.yaw_gain * wrap_angle(desired - yaw)
    rate = clamp(turn, -settings.yaw_rate_limit, settings.yaw_rate_limit)
    share = clamp(setpoint.thrust / (4.0 * settings.max_rotor_thrust), 0.0, 1.0)
    raw = WHOLE * thrust.signal(share, settings.thrust_curve)
    percent = clamp(100.0 * (raw - LEAST) / (LARGEST - LEAST), 0.0, 100.0)
    return Manual(math.degrees(roll), math.degrees(pitch), math.degrees(rate), percent)


def largest_thrust(settings: CrazyflieBridgeParameters) -> float:
    """Return the largest thrust in N that a manual setpoint can ask for: 100 % is not all."""
    u, k = LARGEST / WHOLE, settings.thrust_curve
    return 4.0 * settings.max_rotor_thrust * (k * u * u + (1.0 - k) * u)


def unpacked(packed: int) -> Quat:
    """Return a quaternion of 32 bits: place of the largest part, then sign and size of the other three."""
    parts, largest = [0.0] * 4, packed >> 30
    for place in (3, 2, 1, 0):
        if place != largest:
            size = (packed & _PART) / _PART * math.sqrt(0.5)
            parts[place] = -size if packed >> 9 & 1 else size
            packed >>= 10
    parts[largest] = math.sqrt(max(0.0, 1.0 - sum(part * part for part in parts)))
    return Quat(*parts)


def sample(timestamp_ms: int, block: Mapping[str, float]) -> Sample:
    """Return a log block as an estimate, which samples hold in NED and FRD; its pitch rate has the other sign."""

    def triple(first: str, second: str, third: str) -> Vec3:
        return Vec3(*(1e-3 * block[f"stateEstimateZ.{name}"] for name in (first, second, third)))

    rates = triple("rateRoll", "ratePitch", "rateYaw")
    q = frames.attitude(unpacked(int(block["stateEstimateZ.quat"])))
    p, v = frames.world(triple("x", "y", "z")), frames.world(triple("vx", "vy", "vz"))
    w = frames.body(Vec3(rates.x, -rates.y, rates.z))
    stamp = 1000 * timestamp_ms
    return Sample(stamp, stamp, NED, NED, (p.x, p.y, p.z), (q.w, q.x, q.y, q.z), (v.x, v.y, v.z), (w.x, w.y, w.z), None)
