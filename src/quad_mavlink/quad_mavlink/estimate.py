"""From MAVLink's messages to one estimate: ODOMETRY as it is, ATTITUDE_QUATERNION and LOCAL_POSITION_NED as a pair.

Velocities of ODOMETRY are in the frame of ``child_frame_id``: PX4 sends NED (1), others body FRD (12).
"""

from typing import NamedTuple

from quad_autopilot.odometry import NED, Sample
from quad_core.geometry import rotate
from quad_core.types import Quat, Vec3

LOCAL_NED, BODY_FRD = 1, 12
"""MAV_FRAME."""
LATEST = 30
"""Milliseconds between the two messages of a pair."""
_OTHER = 0

Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]


class Position(NamedTuple):
    """LOCAL_POSITION_NED: ms since boot, m, m/s."""

    time_boot_ms: int
    position: Triple
    velocity: Triple


def of_odometry(
    time_usec: int,
    frames: tuple[int, int],
    position: Triple,
    q: Quadruple,
    velocity: Triple,
    rates: Triple,
    resets: int,
) -> Sample:
    """Return an ODOMETRY as a sample; ``frames``: frame_id, child_frame_id; one that is not NED is marked so."""
    frame, child = frames
    if child == BODY_FRD:
        w, x, y, z = q
        turned = rotate(Quat(x, y, z, w), Vec3(*velocity))
        velocity = (turned.x, turned.y, turned.z)
        child = LOCAL_NED
    known = [NED if each == LOCAL_NED else _OTHER for each in (frame, child)]
    return Sample(time_usec, time_usec, known[0], known[1], position, q, velocity, rates, resets)


def of_pair(time_boot_ms: int, q: Quadruple, rates: Triple, position: Position | None) -> Sample | None:
    """Return an ATTITUDE_QUATERNION with the newest position carried on to its time; None without a near one."""
    if position is None or abs(time_boot_ms - position.time_boot_ms) > LATEST:
        return None
    elapsed = 1e-3 * (time_boot_ms - position.time_boot_ms)
    moved = [p + elapsed * v for p, v in zip(position.position, position.velocity, strict=True)]
    stamp = 1000 * time_boot_ms
    return Sample(stamp, stamp, NED, NED, (moved[0], moved[1], moved[2]), q, position.velocity, rates, 0)
