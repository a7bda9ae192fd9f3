"""What of PX4's odometry is believed, dropped, or a jump."""

import math

import numpy as np
import pytest
from frames_oracle import BODY, WORLD, ned_frd

from quad_autopilot import odometry
from quad_autopilot.odometry import Sample
from quad_core.geometry import quaternion_from_euler
from quad_core.types import Quat, Vec3, VehicleState

GOOD = Sample(1_008_000, 1_000_000, 1, 1, (1.0, 2.0, -3.0), (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, -0.3), (0.4, 0.5, 0.6), 0)


def test_a_good_sample_arrives_in_our_frames():
    q = np.array([0.1, -0.2, 0.3, 0.9])
    q /= np.linalg.norm(q)
    x, y, z, w = ned_frd(q).as_quat().tolist()
    state = odometry.state(GOOD._replace(q=(1.0001 * w, 1.0001 * x, 1.0001 * y, 1.0001 * z)))
    assert odometry.refusal(GOOD, -1) == ""
    assert state.p_w == pytest.approx(WORLD @ GOOD.position)
    assert state.v_w == pytest.approx(WORLD @ GOOD.velocity)
    assert state.omega_b == pytest.approx(BODY @ GOOD.angular_velocity)
    assert np.abs(np.dot(state.q_wb, q)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"pose_frame": 2}, "pose_frame 2"),
        ({"velocity_frame": 3}, "velocity_frame 3"),
        ({"position": (math.nan, 0.0, 0.0)}, "not finite"),
        ({"angular_velocity": (0.0, math.inf, 0.0)}, "not finite"),
        ({"q": (math.nan,) * 4}, "not finite"),
        ({"q": (0.0, 0.0, 0.0, 0.0)}, "length 1"),
        ({"timestamp_sample": 900_000}, "not after 900000"),
        ({"timestamp_sample": 800_000}, "not after 900000"),
    ],
)
def test_a_sample_that_cannot_be_believed_is_dropped_with_the_reason(change, word):
    assert word in odometry.refusal(GOOD._replace(**change), 900_000)


def test_a_jump_is_what_the_motion_does_not_explain():
    before = VehicleState(Vec3(0.0, 0.0, 1.0), Vec3(2.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 1.0))
    turned = Quat(0.0, 0.0, math.sin(0.005), math.cos(0.005))
    assert odometry.jump(before, before._replace(p_w=Vec3(0.02, 0.0, 1.0), q_wb=turned), 0.01) == pytest.approx(
        (0.0, 0.0, 0.0), abs=1e-9
    )
    far = before._replace(p_w=Vec3(0.02, 0.5, 1.0), q_wb=Quat(0.0, 0.0, math.sin(0.1), math.cos(0.1)))
    assert odometry.jump(before, far, 0.01) == pytest.approx((0.5, 0.0, 0.19), abs=1e-9)


def test_a_jump_of_heading_and_one_of_tilt_are_told_apart_at_any_attitude():
    rest = VehicleState(Vec3(), Vec3(), quaternion_from_euler(Vec3(0.3, -0.2, 3.0)), Vec3())
    headed = rest._replace(q_wb=quaternion_from_euler(Vec3(0.3, -0.2, 3.0 + 0.25)))
    assert odometry.jump(rest, headed, 0.01) == pytest.approx((0.0, 0.0, 0.25), abs=1e-7)
    level = rest._replace(q_wb=quaternion_from_euler(Vec3(0.0, 0.0, 1.0)))
    tilted = rest._replace(q_wb=quaternion_from_euler(Vec3(0.0, 0.15, 1.0)))
    assert odometry.jump(level, tilted, 0.01) == pytest.approx((0.0, 0.15, 0.0), abs=1e-7)
