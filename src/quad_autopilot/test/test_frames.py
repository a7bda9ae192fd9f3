"""The frames against rotation matrices of SciPy."""

import numpy as np
import pytest
from frames_oracle import BODY, WORLD, ned_frd
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quad_autopilot import frames
from quad_core.types import Quat, Vec3

numbers = st.floats(-100.0, 100.0)
vectors = st.builds(Vec3, numbers, numbers, numbers)
parts = st.floats(-1.0, 1.0)
attitudes = (
    st.tuples(parts, parts, parts, parts)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: Quat(*(np.array(q) / np.linalg.norm(q)).tolist()))
)


@given(vectors)
def test_vectors_turn_as_the_axes_say_and_back(v):
    assert np.allclose(frames.world(v), WORLD @ v)
    assert np.allclose(frames.body(v), BODY @ v)
    assert frames.world(frames.world(v)) == v
    assert frames.body(frames.body(v)) == v


@given(attitudes)
def test_attitudes_turn_as_the_matrices_say_and_back(q):
    found = frames.attitude(q)
    assert np.allclose(Rotation.from_quat(found).as_matrix(), ned_frd(q).as_matrix(), atol=1e-12)
    assert found.w >= 0.0
    assert np.allclose(Rotation.from_quat(frames.attitude(found)).as_matrix(), Rotation.from_quat(q).as_matrix())


@pytest.mark.parametrize(("yaw_enu", "heading_ned"), [(0.0, 90.0), (90.0, 0.0), (180.0, -90.0), (30.0, 60.0)])
def test_heading_counts_from_north_to_east(yaw_enu, heading_ned):
    q = Quat(*Rotation.from_euler("z", yaw_enu, degrees=True).as_quat().tolist())
    angles = Rotation.from_quat(frames.attitude(q)).as_euler("ZYX", degrees=True)
    assert angles == pytest.approx([heading_ned, 0.0, 0.0], abs=1e-9)


def test_nose_down_and_right_side_down_keep_their_sense():
    # FLU: +pitch is nose down, +roll right side down; FRD: +pitch is nose up, +roll right side down
    for axis, sign in (("x", 1.0), ("y", -1.0)):
        q = Quat(*Rotation.from_euler(axis, 0.2).as_quat().tolist())
        turned = Rotation.from_quat(frames.attitude(q)).as_euler("ZYX")
        expected = [np.pi / 2, 0.0, 0.2] if axis == "x" else [np.pi / 2, sign * 0.2, 0.0]
        assert turned == pytest.approx(expected, abs=1e-9)
