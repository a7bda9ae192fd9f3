"""What of PX4's odometry is believed, dropped, or a jump."""

import math

import numpy as np
import pytest
from frames_oracle import BODY, WORLD, ned_frd

from quad_autopilot import odometry
from quad_autopilot.odometry import Sample, misfit
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


@pytest.mark.parametrize(("change", "word"), [
    ({"pose_frame": 2}, "pose_frame 2"),
    ({"velocity_frame": 3}, "velocity_frame 3"),
    ({"position": (math.nan, 0.0, 0.0)}, "not finite"),
    ({"angular_velocity": (0.0, math.inf, 0.0)}, "not finite"),
    ({"q": (math.nan,) * 4}, "not finite"),
    ({"q": (0.0, 0.0, 0.0, 0.0)}, "length 1"),
    ({"timestamp_sample": 900_000}, "not after 900000"),
    ({"timestamp_sample": 800_000}, "not after 900000"),
])  # fmt: skip
def test_a_sample_that_cannot_be_believed_is_dropped_with_the_reason(change, word):
    assert word in odometry.refusal(GOOD._replace(**change), 900_000)


def jumped(before, after):
    """Return distance, shift, tilt and heading of the jump between two states 10 ms apart."""
    found = odometry.jump(before, after, 0.01)
    return found.distance, *found.shift, found.tilt, found.heading


def test_a_jump_is_what_the_motion_does_not_explain():
    before = VehicleState(Vec3(0.0, 0.0, 1.0), Vec3(2.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3(0.0, 0.0, 1.0))
    turned = Quat(0.0, 0.0, math.sin(0.005), math.cos(0.005))
    assert jumped(before, before._replace(p_w=Vec3(0.02, 0.0, 1.0), q_wb=turned)) == pytest.approx([0.0] * 6, abs=1e-9)
    far = before._replace(p_w=Vec3(0.02, 0.5, 1.0), q_wb=Quat(0.0, 0.0, math.sin(0.1), math.cos(0.1)))
    assert jumped(before, far) == pytest.approx((0.5, 0.0, 0.5, 0.0, 0.0, 0.19), abs=1e-9)


@pytest.mark.parametrize(
    ("change", "reset"),
    [({}, False), ({"p_w": Vec3(0.1, 0.5, 1.0)}, True), ({"q_wb": quaternion_from_euler(Vec3(0.2, 0.0, 0.0))}, True)],
)
def test_without_a_counter_a_jump_is_a_reset_and_a_flight_is_none(change, reset):
    before = VehicleState(Vec3(0.0, 0.0, 1.0), Vec3(10.0, 0.0, 0.0), Quat(0.0, 0.0, 0.0, 1.0), Vec3())
    after = before._replace(**{"p_w": Vec3(0.1, 0.0, 1.0), **change})
    assert odometry.is_reset(odometry.jump(before, after, 0.01), 0.3) == reset


def test_a_jump_of_heading_and_one_of_tilt_are_told_apart_at_any_attitude():
    rest = VehicleState(Vec3(), Vec3(), quaternion_from_euler(Vec3(0.3, -0.2, 3.0)), Vec3())
    headed = rest._replace(q_wb=quaternion_from_euler(Vec3(0.3, -0.2, 3.0 + 0.25)))
    assert jumped(rest, headed)[-2:] == pytest.approx((0.0, 0.25), abs=1e-7)
    level = rest._replace(q_wb=quaternion_from_euler(Vec3(0.0, 0.0, 1.0)))
    tilted = rest._replace(q_wb=quaternion_from_euler(Vec3(0.0, 0.15, 1.0)))
    assert jumped(level, tilted)[-2:] == pytest.approx((0.15, 0.0), abs=1e-7)


MS = 1_000_000
PX4 = [8 * MS, 12 * MS] * 50


def test_the_pair_that_flew_fits_and_the_one_that_tumbled_is_refused_with_its_numbers():
    assert misfit(4 * MS, {"attitude_controller": 2, "position_controller": 5}, PX4) == ""
    text = misfit(2 * MS, {"attitude_controller": 1, "position_controller": 5}, PX4)
    assert "8 ms to 12 ms" in text
    assert "attitude_controller" in text
    assert "1 x 2 ms = 2 ms" in text


def test_too_few_states_say_nothing():
    assert "10 states so far" in misfit(4 * MS, {}, [8 * MS] * 10)


def test_two_states_in_one_period_are_refused():
    assert "at most one state" in misfit(10 * MS, {"attitude_controller": 1}, PX4)


def test_one_lost_state_is_no_other_rate():
    assert misfit(4 * MS, {"attitude_controller": 2}, [*PX4, *[20 * MS] * 8]) == ""
    assert misfit(4 * MS, {"attitude_controller": 2}, [20 * MS] * 50) != ""


@pytest.mark.parametrize("steps", range(1, 12))
def test_what_is_said_is_what_a_controller_would_compute(steps):
    # a controller answers the first state that is at least its period after the last
    longest, last, now = 0, 0, 0
    for gap in [8, 8, 12, 12, 8, 12] * 60:
        now += gap
        if now - last >= 4 * steps:
            longest, last = max(longest, now - last), now
    fits = misfit(4 * MS, {"attitude_controller": steps}, PX4) == ""
    assert fits <= (longest <= 8 * steps)
    if steps in (1, 2, 4):
        assert fits == (longest <= 8 * steps)
