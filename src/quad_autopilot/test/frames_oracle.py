"""The frames as matrices: written from PX4's and MAVLink's documentation, importing nothing of the bridges."""

import numpy as np
from scipy.spatial.transform import Rotation

WORLD = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
BODY = np.diag([1.0, -1.0, -1.0])


def ned_frd(q_xyzw):
    """Return the attitude of FRD in NED as a Rotation, of FLU in ENU as a quaternion xyzw."""
    return Rotation.from_matrix(WORLD @ Rotation.from_quat(q_xyzw).as_matrix() @ BODY)
