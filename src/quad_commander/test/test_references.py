"""References of the modes: no step in p, v, a at any change of mode, within limits, always to rest."""

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from quad_commander import references as refs
from quad_commander.references import AxisLimits, ReferenceLimits
from quad_core.enumerations import Mode
from quad_core.types import TrajectoryPoint, Vec3

LIMITS = ReferenceLimits()
GROUND, HEIGHT = 0.0, 1.5
OWN = [Mode.TAKEOFF, Mode.HOLD, Mode.LAND]
ZERO = Vec3(0.0, 0.0, 0.0)


def vectors(bound):
    return st.builds(Vec3, *(st.floats(-bound, bound),) * 3)


points = st.builds(
    TrajectoryPoint,
    st.just(0.0),
    st.builds(Vec3, st.floats(-100.0, 100.0), st.floats(-100.0, 100.0), st.floats(0.0, 30.0)),
    vectors(5.0),
    vectors(8.0),
    st.just(ZERO),
    st.just(ZERO),
    st.floats(-3.1, 3.1),
    st.floats(-2.0, 2.0),
    st.floats(-4.0, 4.0),
)


def axes(point):
    """Return (p, v, a) of x, y, z and yaw."""
    return [*zip(point.p_w, point.v_w, point.a_w, strict=True), (point.yaw, point.yaw_rate, point.yaw_acceleration)]


def limits_of(mode):
    vertical = LIMITS.landing if mode == Mode.LAND else LIMITS.climb
    return [LIMITS.horizontal, LIMITS.horizontal, vertical, LIMITS.yaw]


def assert_follows(start, later, seconds, limits):
    """Demand that ``later`` can be ``seconds`` after ``start`` without a step in p, v or a."""
    for (p, v, a), (p2, v2, a2), bound in zip(axes(start), axes(later), limits, strict=True):
        jerk = bound.jerk * (1.0 + 1e-9)
        assert abs(a2 - a) <= jerk * seconds + 1e-9
        assert abs(v2 - v - seconds * a) <= 0.5 * jerk * seconds * seconds + 1e-9
        assert abs(p2 - p - seconds * v - 0.5 * seconds * seconds * a) <= jerk * seconds**3 / 6.0 + 1e-9


def assert_within(start, point, limits):
    """Demand that nothing exceeds its limit by more than the start did."""
    for (_, v0, a0), (_, v, a), bound in zip(axes(start), axes(point), limits, strict=True):
        assert abs(a) <= max(abs(a0), bound.acceleration) + 1e-9
        assert abs(v) <= max(abs(v0) + 0.5 * a0 * a0 / bound.jerk, bound.speed) + 1e-9


@settings(max_examples=60)
@given(points, st.sampled_from(OWN), st.sampled_from(OWN), st.floats(0.0, 8.0))
def test_no_change_of_mode_steps_the_reference(start, first, second, when):
    """From what any mission flies into ``first``, and from the middle of that into ``second``."""
    for mode, duration in ((first, when), (second, 1e9)):
        limits = limits_of(mode)
        plan = refs.plan_mode(LIMITS, mode, start, GROUND, HEIGHT)
        before = refs.sample(plan, 0.0)
        assert axes(before) == [pytest.approx(axis, abs=1e-12) for axis in axes(start)]
        end = min(plan.duration + 0.05, duration)
        step = max(end / 300.0, 1e-6)
        for number in range(1, 301):
            point = refs.sample(plan, number * step)
            assert_follows(before, point, step, limits)
            assert_within(start, point, limits)
            before = point
        start = refs.sample(plan, end)


@given(points, st.sampled_from(OWN))
def test_each_mode_ends_at_rest_where_it_should(start, mode):
    plan = refs.plan_mode(LIMITS, mode, start, GROUND, HEIGHT)
    assert math.isfinite(plan.duration)
    last = refs.sample(plan, plan.duration)
    assert (last.v_w, last.a_w, last.yaw_rate, last.yaw_acceleration) == (ZERO, ZERO, 0.0, 0.0)
    assert last == refs.sample(plan, plan.duration + 100.0)._replace(trajectory_time=last.trajectory_time)
    if mode == Mode.TAKEOFF:
        assert last.p_w.z >= GROUND + HEIGHT
    if mode == Mode.LAND:
        assert last.p_w.z <= GROUND - LIMITS.landing_depth


@given(points, st.builds(refs.Place, *(st.floats(-90.0, 90.0),) * 3, st.none() | st.floats(-6.0, 6.0)))
def test_the_way_to_a_place_is_within_the_limits_and_ends_there(start, place):
    plan = refs.plan_mode(LIMITS, Mode.HOLD, start, GROUND, HEIGHT, place)
    for number in range(101):
        assert_within(start, refs.sample(plan, plan.duration * number / 100.0), limits_of(Mode.HOLD))
    last = refs.sample(plan, plan.duration)
    assert last.p_w == pytest.approx(place[:3])
    assert (last.v_w, last.a_w, last.yaw_rate) == (ZERO, ZERO, 0.0)
    if place.yaw is not None:
        assert math.cos(last.yaw - place.yaw) == pytest.approx(1.0)
        stop = refs.sample(refs.plan_mode(LIMITS, Mode.HOLD, start, GROUND, HEIGHT), 1e9).yaw
        assert abs(last.yaw - stop) <= math.pi + 1e-9, "the short way"


@settings(max_examples=60)
@given(points, points)
def test_the_way_into_a_mission_has_no_step_either(current, mission):
    assume(abs(current.yaw - mission.yaw) < math.pi)
    plan = refs.plan_hand_over(LIMITS, current, mission)
    first = refs.handed_over(plan, 0.0, mission)
    assert axes(first) == [pytest.approx(axis, abs=1e-9) for axis in axes(current)]
    for number in range(200):
        time = plan.duration * number / 200.0
        one, two = (refs.handed_over(plan, time + extra, mission) for extra in (0.0, 1e-3))
        # the mission itself stands still here, so that the rest of the difference alone moves
        steps = [abs(after[2] - before[2]) for before, after in zip(axes(one), axes(two), strict=True)]
        assert max(steps) <= 8.0 * 1e-3 + 1e-9
    assert refs.handed_over(plan, plan.duration, mission) is mission


def test_the_heading_turns_the_short_way_into_a_mission():
    current, mission = (TrajectoryPoint(yaw=yaw) for yaw in (3.0, -3.0))
    plan = refs.plan_hand_over(LIMITS, current, mission)
    assert refs.handed_over(plan, 0.0, mission).yaw == pytest.approx(3.0 - 2.0 * math.pi)


def ruckig_duration(p, v, a, target, bound):
    """Return the least time that Ruckig needs; ``target`` None: to rest anywhere."""
    ruckig = pytest.importorskip("ruckig")
    inputs = ruckig.InputParameter(1)
    inputs.current_position, inputs.current_velocity, inputs.current_acceleration = [p], [v], [a]
    inputs.target_velocity, inputs.target_acceleration = [0.0], [0.0]
    inputs.max_velocity, inputs.max_acceleration, inputs.max_jerk = [bound.speed], [bound.acceleration], [bound.jerk]
    if target is None:
        inputs.control_interface = ruckig.ControlInterface.Velocity
    else:
        inputs.target_position = [target]
    trajectory = ruckig.Trajectory(1)
    assert ruckig.Ruckig(1).calculate(inputs, trajectory) == ruckig.Result.Working
    return trajectory.duration, trajectory.at_time(trajectory.duration)[0][0]


@given(st.floats(-10.0, 10.0), st.floats(-2.0, 2.0))
def test_stops_are_as_quick_as_ruckigs(v, a):
    bound = AxisLimits(1.0, 2.0, 6.0)
    plan = refs.stopped(bound, refs.AxisPoint(0.0, v, a, 0.0, 0.0))
    duration, end = ruckig_duration(0.0, v, a, None, bound)
    assert plan.duration == pytest.approx(duration, abs=1e-6)
    assert plan.end == pytest.approx(end, abs=1e-5)


@given(st.floats(1e-6, 30.0), st.floats(0.3, 3.0), st.floats(0.3, 5.0), st.floats(1.0, 20.0))
def test_ways_from_rest_to_rest_are_as_quick_as_ruckigs(way, speed, acceleration, jerk):
    bound = AxisLimits(speed, acceleration, jerk)
    plan = refs.moved(bound, refs.stopped(bound, refs.resting(0.0)), way)
    duration, _ = ruckig_duration(0.0, 0.0, 0.0, way, bound)
    assert plan.duration == pytest.approx(duration, rel=1e-6)
    last = refs.at(plan, plan.duration * (1.0 - 1e-12))
    assert last.p == pytest.approx(way, rel=1e-6, abs=1e-9)
