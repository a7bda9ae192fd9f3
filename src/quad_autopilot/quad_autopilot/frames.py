"""Between the frames of this stack (world ENU, body FLU) and an autopilot's (world NED, body FRD).

::

    world:  (n, e, d) = (y, x, -z)                       body:  (x, y, z)_frd = (x, -y, -z)_flu
    q_ned_frd = (0, s, s, 0) q_enu_flu (0, 1, 0, 0)      wxyz, s = sqrt(1/2)

Each function here is its own inverse, the quaternion's up to sign, which is the same attitude.
"""

import math

from quad_core.types import Quat, Vec3

_S = math.sqrt(0.5)


def world(v: Vec3) -> Vec3:
    """Return a world vector of ENU in NED, or of NED in ENU; any unit."""
    return Vec3(v.y, v.x, -v.z)


def body(v: Vec3) -> Vec3:
    """Return a body vector of FLU in FRD, or of FRD in FLU; any unit."""
    return Vec3(v.x, -v.y, -v.z)


def attitude(q: Quat) -> Quat:
    """Return the attitude of FLU in ENU as that of FRD in NED, or back; unit quaternions, w >= 0 in the result."""
    # (0, s, s, 0) q (0, 1, 0, 0), multiplied out
    w, x, y, z = -_S * (q.w + q.z), -_S * (q.x + q.y), _S * (q.y - q.x), _S * (q.z - q.w)
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    return Quat(x, y, z, w)
