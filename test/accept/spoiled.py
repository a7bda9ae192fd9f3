"""What mistakes make of an estimate: position (world), quaternion xyzw, velocity and body rates (body frame)."""

import numpy as np
from scipy.spatial.transform import Rotation


def turned(vector, quaternion, inverse=False):
    """Return a vector turned by an attitude."""
    return Rotation.from_quat(quaternion).apply(vector, inverse=inverse)


def moved(matrix, attitude=None):
    """Return what sees the world through a matrix, and the body by another attitude."""

    def change(p, q, v, w):
        return matrix @ np.array(p), attitude(q) if attitude else q, v, w

    return change


def of_twist(change):
    """Return a mistake in the twist alone."""
    return lambda p, q, v, w: (p, q, *change(q, np.array(v), np.array(w)))


def about_z(degrees):
    """Return an attitude turned about the world's z axis."""
    return lambda q: (Rotation.from_euler("z", degrees, degrees=True) * Rotation.from_quat(q)).as_quat()


def about_body(axis, degrees):
    """Return an attitude turned about a body axis."""
    return lambda q: (Rotation.from_quat(q) * Rotation.from_euler(axis, degrees, degrees=True)).as_quat()


SAME, SWAP, MIRROR = np.eye(3), np.array([[0, 1, 0], [1, 0, 0], [0, 0, 1.0]]), np.diag([1.0, -1.0, 1.0])
NED, FRD = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]]), np.diag([1.0, -1.0, -1.0])


def ned(q):
    """Return the attitude of an FRD body in NED."""
    return Rotation.from_matrix(NED @ Rotation.from_quat(q).as_matrix() @ FRD).as_quat()


CHANGES = {
    **{f"heading {angle}": moved(SAME, about_z(angle)) for angle in (15, 45, 90, 180, -90)},
    "axes swapped": moved(SWAP),
    "left-handed": moved(MIRROR),
    "ned": lambda p, q, v, w: (NED @ np.array(p), ned(q), FRD @ np.array(v), FRD @ np.array(w)),
    "ned position": moved(NED),
    "frd": lambda p, q, v, w: (p, about_body("x", 180)(q), FRD @ np.array(v), FRD @ np.array(w)),
    "mm": moved(1000.0 * SAME),
    "cm": moved(100.0 * SAME),
    "ft": moved(SAME / 0.3048),
    "wxyz": moved(SAME, lambda q: (q[3], q[0], q[1], q[2])),
    "conjugate": moved(SAME, lambda q: (-q[0], -q[1], -q[2], q[3])),
    "on its side": moved(SAME, about_body("x", 90)),
    "on its head": moved(SAME, about_body("x", 180)),
    "world twist": of_twist(lambda q, v, w: (turned(v, q), w)),
    "zero twist": of_twist(lambda q, v, w: (0 * v, 0 * w)),
    "zero velocity": of_twist(lambda q, v, w: (0 * v, w)),
    "sign": of_twist(lambda q, v, w: (-v, w)),
    "frd twist": of_twist(lambda q, v, w: (FRD @ v, FRD @ w)),
    "degrees": of_twist(lambda q, v, w: (v, np.degrees(w))),
    "km/h": of_twist(lambda q, v, w: (3.6 * v, w)),
    "rates of other axes": of_twist(lambda q, v, w: (v, w[[1, 0, 2]])),
}
"""{mistake: what it makes of position, attitude, and both parts of the twist}."""
