"""The command filter on SO(3): the tilt first, then the turn; near level the filter of each angle."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_attitude_ctrl.command import CommandFilter, CommandSource, FilterState, Shaping, next_filter_state
from quad_attitude_ctrl.rotation_filter import at_rest, next_rotation, way_to
from quad_core.geometry import quaternion_from_euler
from quad_core.types import Quat, Vec3

DT = 0.002
PLAIN = CommandFilter(bandwidth=40.0, max_rate=1e6)
SLOW = CommandFilter(bandwidth=8.0, max_rate=1.5)
SHAPING = Shaping(CommandSource.FILTER, PLAIN, PLAIN, SLOW)


def quaternion(rotation):
    return Quat(*map(float, rotation.as_quat()))


def test_the_target_turns_no_faster_than_each_axis_may():
    slow = Shaping(CommandSource.FILTER, *(CommandFilter(8.0, rate) for rate in (1.0, 2.0, 3.0)))
    for axis, rate in enumerate((1.0, 2.0, 3.0)):
        for sign in (-1.0, 1.0):
            target = quaternion(Rotation.from_rotvec(sign * np.eye(3)[axis]))
            found = next_rotation(at_rest(Quat(0.0, 0.0, 0.0, 1.0)), target, slow, 3.0, DT).target
            expected = np.zeros(3)
            expected[axis] = sign * rate * DT
            assert Rotation.from_quat(found).as_rotvec() == pytest.approx(expected, abs=1e-12)


def test_a_way_is_the_tilt_and_then_the_turn_about_the_thrust():
    rng = np.random.default_rng(2)
    for _ in range(300):
        q = Rotation.random(random_state=rng)
        way = way_to(quaternion(q))
        again = Rotation.from_rotvec([way.x, way.y, 0.0]) * Rotation.from_rotvec([0.0, 0.0, way.z])
        assert (again.inv() * q).magnitude() < 1e-9
        up = q.apply([0.0, 0.0, 1.0])
        assert math.hypot(way.x, way.y) == pytest.approx(math.acos(up[2]), abs=1e-7)
        assert -math.pi < way.z <= math.pi


def test_small_ways_are_filtered_as_angles_are():
    target = Vec3(1e-3, -2e-3, 1.5e-3)
    state = at_rest(Quat(0.0, 0.0, 0.0, 1.0))
    axes = [FilterState(0.0, 0.0, 0.0, 0.0)] * 3
    for _ in range(100):
        state = next_rotation(state, quaternion_from_euler(target), SHAPING, 0.6, DT)
        axes = [
            next_filter_state(axis, raw, kind.bandwidth, kind.max_rate, DT)
            for axis, raw, kind in zip(axes, target, (PLAIN, PLAIN, SLOW), strict=True)
        ]
    found = Rotation.from_quat(state.attitude).as_rotvec()
    assert list(found) == pytest.approx([axis.angle for axis in axes], abs=1e-5)
    assert state.rates == pytest.approx([axis.rate for axis in axes], abs=1e-4)


def test_a_filter_that_is_far_off_asks_for_no_more_than_its_way_admits():
    state, fastest, hardest = at_rest(Quat(1.0, 0.0, 0.0, 0.0)), 0.0, 0.0
    for _ in range(600):
        state = next_rotation(state, Quat(0.0, 0.0, 0.0, 1.0), SHAPING, 0.6, DT)
        fastest, hardest = max(fastest, abs(state.rates.x)), max(hardest, abs(state.accelerations.x))
    # a constant way w moves a filter of three poles b at b w / 3
    assert fastest < 1.01 * 40.0 * 0.6 / 3.0
    assert hardest < 0.35 * 0.6 * 1600.0
    assert Rotation.from_quat(state.attitude).magnitude() < 1e-3


def test_a_turn_that_is_far_off_is_made_no_faster_than_its_way_admits():
    goal = quaternion(Rotation.from_euler("z", 3.0))
    state, fastest = at_rest(Quat(0.0, 0.0, 0.0, 1.0))._replace(target=goal), 0.0
    for _ in range(600):
        state = next_rotation(state, goal, SHAPING, 0.6, DT)
        fastest = max(fastest, state.rates.z)
    assert 1.5 < fastest < 1.01 * 8.0 * 0.6 / 3.0


def time_to_point_up(turn):
    """Return when the thrust of a filter tilted by 1 rad points up to 5 degrees, its input ``turn`` rad away in yaw."""
    goal = quaternion(Rotation.from_euler("z", turn))
    state = at_rest(quaternion(Rotation.from_euler("x", 1.0)))._replace(target=goal)
    for k in range(500):
        if Rotation.from_quat(state.attitude).apply([0.0, 0.0, 1.0])[2] > math.cos(math.radians(5.0)):
            return k * DT
        state = next_rotation(state, goal, SHAPING, 0.6, DT)
    return math.inf


@pytest.mark.parametrize("turn", [-2.0, 0.5, 2.5])
def test_a_turn_that_is_left_does_not_delay_the_thrust(turn):
    assert time_to_point_up(turn) == pytest.approx(time_to_point_up(0.0), abs=0.02)
