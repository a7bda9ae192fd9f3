"""The command filter on SO(3): the tilt first, then the turn; near level the filter of each angle."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_attitude_ctrl.command import CommandFilter, CommandSource, FilterState, next_filter_state
from quad_attitude_ctrl.rotation_filter import (
    RotationShaping,
    at_rest,
    goal_of,
    next_rotation,
    set_attitude,
    set_goal,
    swing_twist,
)
from quad_core.geometry import quaternion_from_euler
from quad_core.types import AttitudeThrust, Quat, Vec3

DT = 0.002
PLAIN = CommandFilter(bandwidth=40.0, max_rate=1e6)
SLOW = CommandFilter(bandwidth=8.0, max_rate=1.5)
SHAPING = RotationShaping(CommandSource.FILTER, PLAIN, PLAIN, SLOW, 0.6)
ZERO = Vec3(0.0, 0.0, 0.0)


def quaternion(rotation):
    return Quat(*map(float, rotation.as_quat()))


def setpoint(rotation, rates=ZERO, accelerations=ZERO):
    """Return the setpoint of an attitude that is tilted in its own heading."""
    yaw, pitch, roll = map(float, rotation.as_euler("ZYX"))
    return AttitudeThrust(Vec3(roll, pitch, yaw), rates, accelerations, quaternion(rotation), 5.0, 0.3)


def beginning(rotation, goal=None):
    return at_rest(quaternion(rotation), setpoint(rotation if goal is None else goal))


LEVEL = beginning(Rotation.identity())


def test_the_target_tilts_no_faster_than_each_axis_may():
    slow = RotationShaping(CommandSource.FILTER, *(CommandFilter(8.0, rate) for rate in (1.0, 2.0, 1e6)), 3.0)
    for axis, rate in enumerate((1.0, 2.0)):
        for sign in (-1.0, 1.0):
            goal = setpoint(Rotation.from_rotvec(sign * np.eye(3)[axis]))
            expected = np.zeros(3)
            expected[axis] = sign * rate * DT
            found = next_rotation(slow, LEVEL, goal, DT).target
            assert Rotation.from_quat(found).as_rotvec() == pytest.approx(expected, abs=1e-12)


def test_a_way_is_the_tilt_and_then_the_turn_about_the_thrust():
    rng = np.random.default_rng(2)
    for _ in range(300):
        q = Rotation.random(random_state=rng)
        way = swing_twist(quaternion(q))
        again = Rotation.from_rotvec([way.x, way.y, 0.0]) * Rotation.from_rotvec([0.0, 0.0, way.z])
        assert (again.inv() * q).magnitude() < 1e-9
        up = q.apply([0.0, 0.0, 1.0])
        assert math.hypot(way.x, way.y) == pytest.approx(math.acos(up[2]), abs=1e-7)
        assert -math.pi < way.z <= math.pi


def test_small_ways_are_filtered_as_angles_are():
    target = Vec3(1e-3, -2e-3, 1.5e-3)
    state = LEVEL
    axes = [FilterState(0.0, 0.0, 0.0, 0.0)] * 3
    for _ in range(100):
        state = next_rotation(SHAPING, state, setpoint(Rotation.from_euler("ZYX", target[::-1])), DT)
        axes = [
            next_filter_state(axis, raw, kind.bandwidth, kind.max_rate, DT)
            for axis, raw, kind in zip(axes, target, (PLAIN, PLAIN, SLOW), strict=True)
        ]
    found = Rotation.from_quat(state.attitude).as_rotvec()
    assert list(found)[:2] == pytest.approx([axis.angle for axis in axes[:2]], abs=1e-5)
    assert list(state.rates)[:2] == pytest.approx([axis.rate for axis in axes[:2]], abs=1e-4)
    assert state.heading[:3] == pytest.approx(axes[2][:3], abs=1e-9)


def test_a_filter_that_is_far_off_asks_for_no_more_than_its_way_admits():
    state, fastest, hardest = beginning(Rotation.from_euler("x", math.pi), Rotation.identity()), 0.0, 0.0
    for _ in range(600):
        state = next_rotation(SHAPING, state, setpoint(Rotation.identity()), DT)
        fastest, hardest = max(fastest, abs(state.rates.x)), max(hardest, abs(state.accelerations.x))
    # a constant way w moves a filter of three poles b at b w / 3
    assert fastest < 1.01 * 40.0 * 0.6 / 3.0
    assert hardest < 0.35 * 0.6 * 1600.0
    assert Rotation.from_quat(state.attitude).magnitude() < 1e-3


def test_a_step_of_the_set_yaw_turns_no_faster_than_the_heading_may():
    goal, state, fastest = setpoint(Rotation.from_euler("zx", [3.0, 0.4])), LEVEL, 0.0
    state = beginning(Rotation.from_euler("x", 0.4))
    for _ in range(2500):
        state = next_rotation(SHAPING, state, goal, DT)
        fastest = max(fastest, abs(state.rates.z))
        up = Rotation.from_quat(state.attitude).apply([0.0, 0.0, 1.0])
    assert 1.4 < fastest < 1.51
    assert (Rotation.from_quat(state.attitude).inv() * Rotation.from_quat(goal.q_wb)).magnitude() < 1e-3
    assert up == pytest.approx(Rotation.from_quat(goal.q_wb).apply([0.0, 0.0, 1.0]), abs=1e-4)


def test_tilting_far_at_a_constant_yaw_is_followed_as_fast_about_the_thrust_as_across_it():
    """A thrust that runs round a cone of 70 degrees at 5 rad/s needs 5 sin^2(35 deg) 2 rad/s about itself."""
    led = SHAPING._replace(command=CommandSource.LED)

    def goal(t, h=1e-5):
        def angles(at):
            north, east = math.sin(5.0 * at), math.cos(5.0 * at)
            tilt = math.tan(math.radians(70.0))
            pitch = math.atan(tilt * east)
            return np.array([math.atan(-math.cos(pitch) * tilt * north), pitch, 0.4])

        before, now, after = angles(t - h), angles(t), angles(t + h)
        rates, accelerations = (after - before) / (2.0 * h), (after - 2.0 * now + before) / (h * h)
        q = quaternion_from_euler(Vec3(*now))
        return AttitudeThrust(Vec3(*now), Vec3(*rates), Vec3(*accelerations), q, 5.0, 0.3)

    state = at_rest(goal(0.0).q_wb, goal(0.0))
    for k in range(1000):
        state = next_rotation(led, state, goal(k * DT), DT)
    apart = Rotation.from_quat(goal(1000 * DT).q_wb).inv() * Rotation.from_quat(state.attitude)
    assert apart.magnitude() < 0.01


def time_to_point_up(turn):
    """Return when the thrust of a filter tilted by 1 rad points up to 5 degrees, its input ``turn`` rad away in yaw."""
    goal = Rotation.from_euler("z", turn)
    state = beginning(Rotation.from_euler("x", 1.0), goal)
    state = state._replace(heading=FilterState(turn, 0.0, 0.0, turn))
    for k in range(500):
        if Rotation.from_quat(state.attitude).apply([0.0, 0.0, 1.0])[2] > math.cos(math.radians(5.0)):
            return k * DT
        state = next_rotation(SHAPING, state, setpoint(goal), DT)
    return math.inf


@pytest.mark.parametrize("turn", [-2.0, 0.5, 2.5])
def test_a_turn_that_is_left_does_not_delay_the_thrust(turn):
    assert time_to_point_up(turn) == pytest.approx(time_to_point_up(0.0), abs=0.02)


def test_from_any_attitude_it_begins_without_a_turn():
    rng = np.random.default_rng(8)
    for _ in range(50):
        start, goal = Rotation.random(random_state=rng), Rotation.from_euler("ZYX", rng.uniform(-1.4, 1.4, 3))
        state = next_rotation(SHAPING, at_rest(quaternion(start), setpoint(goal)), setpoint(goal), DT)
        about = swing_twist(quaternion(start.inv() * Rotation.from_quat(state.target))).z
        assert abs(about) < 1.1 * 1.5 * DT


def test_the_goal_comes_from_the_chosen_source():
    goal = setpoint(Rotation.from_euler("ZYX", [0.5, 0.3, 0.2]), Vec3(0.4, -0.3, 0.6), Vec3(1.5, 0.7, -0.9))
    state = LEVEL._replace(rates=Vec3(1.0, 2.0, 3.0), accelerations=Vec3(4.0, 5.0, 6.0))
    for source in (CommandSource.FILTER, CommandSource.LED):
        assert goal_of(source, state, goal) == (state.attitude, state.rates, state.accelerations)
    assert goal_of(CommandSource.RAW, state, goal) == (set_attitude(goal), ZERO, ZERO)
    assert goal_of(CommandSource.FEED_FORWARD, state, goal) == set_goal(goal)


def test_a_setpoint_without_an_attitude_is_flown_by_its_angles():
    goal = Vec3(0.3, -0.2, 1.0)
    named = AttitudeThrust(goal, ZERO, ZERO, quaternion_from_euler(goal), 5.0, 0.3)
    for none in (Quat(0.0, 0.0, 0.0, 0.0), Quat(0.0, 1e154, 0.0, 1e154)):
        assert set_attitude(named._replace(q_wb=none)) == named.q_wb
    longer = named._replace(q_wb=Quat(*(1.2 * part for part in named.q_wb)))
    assert set_attitude(longer) == pytest.approx(named.q_wb, abs=1e-15)


def test_the_attitude_of_a_setpoint_counts_not_its_angles():
    aside = quaternion_from_euler(Vec3(0.2, 0.3, 0.5))
    named = AttitudeThrust(Vec3(0.3, -0.2, 1.0), ZERO, ZERO, aside, 5.0, 0.3)
    assert set_attitude(named) == pytest.approx(aside, abs=1e-15)
    assert set_goal(named).attitude == set_attitude(named)
